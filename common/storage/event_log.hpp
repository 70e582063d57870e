#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

// LCM event logs with time stamps that the caller chooses. Format (big endian): sync word
// 0xEDA1DA01, event number i64, utime i64, channel length u32, data length u32, channel, data. Not
// through LCM 1.3.1's own code: that takes a wrong sync word for the end of the file, allocates
// what a damaged length says, and cannot undo a record that the disk had no room for.
namespace seastitch {

struct LogEvent {
  std::int64_t utime = 0;  // when the logger received it
  std::string channel;
  std::vector<std::uint8_t> data;
};

// Bytes of an event in a log.
std::size_t SizeInLog(const LogEvent& event);

// Whether a log can hold an event: the channel has 1 to 63 bytes without NUL, as LCM's have, and
// the data at most 256 MB. LCM itself delivers an empty channel name.
bool IsLoggable(const std::string& channel, std::size_t data_size);

class EventLogReader {
 public:
  // Throws std::runtime_error "FILE: reason" where it cannot be opened or holds no LCM event.
  explicit EventLogReader(const std::filesystem::path& path);
  ~EventLogReader();
  // The next whole event: one that another one, or the end of the file, follows at once. Skips
  // anything else to the next such event and counts the bytes.
  std::optional<LogEvent> Next();
  std::int64_t damaged_bytes() const;
  std::int64_t tears() const;  // places where they stand

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

enum class IfExists { kReplace, kRefuse };

class EventLogWriter {
 public:
  // Throws std::runtime_error "FILE: reason".
  explicit EventLogWriter(const std::filesystem::path& path,
                          IfExists if_exists = IfExists::kReplace);
  ~EventLogWriter();  // flushes
  EventLogWriter(EventLogWriter&&) noexcept;
  // Takes an event that IsLoggable(); throws std::runtime_error for any other. It reaches the
  // file with the next Flush(), or when 256 kB wait. Throws
  // std::runtime_error "FILE: reason" when they find no room: then the event is not taken, the file
  // ends with a whole event, and what waits is tried again by the next call.
  void Write(std::int64_t utime, const std::string& channel, const void* data, std::size_t size);
  template <class Msg>
  void Write(std::int64_t utime, const std::string& channel, const Msg& msg) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    Write(utime, channel, bytes.data(), bytes.size());
  }
  // Both throw like Write(), and may be tried again.
  void Flush();  // to the kernel: survives the end of the process
  void Sync();   // to the disk: survives the end of the power
  // Brings what was flushed by then to the disk: by any thread, also beside one that writes. Throws
  // like Write().
  std::function<void()> Syncer() const;
  std::int64_t bytes() const;   // in the file
  std::int64_t events() const;  // in the file

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch
