#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// Reader and writer of LCM event logs. Format (big endian): sync word 0xEDA1DA01, event number i64,
// utime i64 [us since the Unix epoch], channel length u32, data length u32, channel, data.
//
// LCM 1.3.1's own code is not used. It regards a wrong sync word as the end of the file, allocates
// as much memory as a damaged length states, and cannot remove a record that was written in part
// because the disk was full.
namespace seastitch {

struct LogEvent {
  std::int64_t utime = 0;  // receive time at the logger, not the measurement's time
  std::string channel;
  std::vector<std::uint8_t> data;
  std::size_t unread = 0;  // bytes of the data, at its end, that were not read
};

// Bytes of an event in a log: header, channel and data.
std::size_t SizeInLog(const LogEvent& event);

// True if a log can store the event: the channel has 1 to 63 bytes without NUL, and the data at
// most 256 MB. (The LCM bus also delivers messages with an empty channel name.)
bool IsLoggable(const std::string& channel, std::size_t data_size);

// A log, or the bytes from `begin` to `end` of one: whole events.
struct LogPart {
  // NOLINTNEXTLINE(google-explicit-constructor): a log is its own only part
  LogPart(std::filesystem::path log) : path(std::move(log)) {}
  LogPart(std::filesystem::path log, std::uint64_t from, std::uint64_t to)
      : path(std::move(log)), begin(from), end(to) {}
  friend bool operator==(const LogPart&, const LogPart&) = default;
  // Bytes in the file as it is now. Throws std::filesystem::filesystem_error.
  std::uint64_t Size() const { return std::min(end, std::filesystem::file_size(path)) - begin; }

  std::filesystem::path path;
  std::uint64_t begin = 0;
  std::uint64_t end = UINT64_MAX;
};

// A file that has no LCM event, such as an empty one or one of another kind.
struct NoEventError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class EventLogReader {
 public:
  // How much of the data of a channel's events is wanted, from the beginning.
  using Wanted = std::function<std::size_t(const std::string& channel)>;

  // Throws std::runtime_error "FILE: reason" where the file cannot be opened; NoEventError. wanted:
  // most of the rest stays unread on the disk; without it all is wanted.
  explicit EventLogReader(const std::filesystem::path& path) : EventLogReader(LogPart(path)) {}
  explicit EventLogReader(const LogPart& log, Wanted wanted = {});
  ~EventLogReader();
  // The next intact event; std::nullopt at the end of the file. An event is intact if a sync word
  // or the end of the file follows its last byte. Damaged bytes are skipped and counted.
  std::optional<LogEvent> Next();
  // Byte of the file after the last event given.
  std::uint64_t position() const;
  std::int64_t damaged_bytes() const;
  std::int64_t tears() const;  // number of damaged sections

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// What to do with an existing file: overwrite it, or throw.
enum class IfExists { kReplace, kRefuse };

class EventLogWriter {
 public:
  // Throws std::runtime_error "FILE: reason".
  explicit EventLogWriter(const std::filesystem::path& path,
                          IfExists if_exists = IfExists::kReplace);
  ~EventLogWriter();  // flushes
  EventLogWriter(EventLogWriter&&) noexcept;
  // Adds an event to the buffer. The buffer is written to the file by Flush(), or when it has 256
  // kB. Throws std::runtime_error for an event that is not IsLoggable(). Throws std::runtime_error
  // "FILE: reason" where the buffer cannot be written, such as on a full disk. Then the event was
  // not added and has to be written again; the file ends with a whole event; and the buffer is kept
  // for the next call.
  void Write(std::int64_t utime, const std::string& channel, const void* data, std::size_t size);
  template <class Msg>
  void Write(std::int64_t utime, const std::string& channel, const Msg& msg) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    Write(utime, channel, bytes.data(), bytes.size());
  }
  // Both throw like Write(), and may be called again.
  void Flush();  // writes the buffer to the kernel: survives a crash of the process
  void Sync();   // Flush() and fsync: survives a power cut
  // Function that calls fsync: what was flushed before its call survives a power cut. It may be
  // called on any thread, also during Write(). Throws like Write().
  std::function<void()> Syncer() const;
  std::int64_t bytes() const;   // in the file, without the buffer
  std::int64_t events() const;  // in the file, without the buffer

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch
