#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

// LCM event logs, read and written with LCM's own code, with time stamps that the caller chooses.
namespace seastitch {

struct LogEvent {
  std::int64_t utime = 0;  // when the logger received it
  std::string channel;
  std::vector<std::uint8_t> data;
};

class EventLogReader {
 public:
  // Throws std::runtime_error "FILE: reason" where it cannot be opened or holds no LCM event.
  explicit EventLogReader(const std::filesystem::path& path);
  ~EventLogReader();
  // The next whole event. Skips damaged bytes to the next event and counts them.
  std::optional<LogEvent> Next();
  std::int64_t damaged_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class EventLogWriter {
 public:
  explicit EventLogWriter(
      const std::filesystem::path& path);  // throws; an existing file is replaced
  ~EventLogWriter();
  // Throws std::runtime_error when the disk is full; what was written stays readable.
  void Write(std::int64_t utime, const std::string& channel, const void* data, std::size_t size);
  template <class Msg>
  void Write(std::int64_t utime, const std::string& channel, const Msg& msg) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    Write(utime, channel, bytes.data(), bytes.size());
  }
  void Flush();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch
