#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "common/runtime/files/file_identity.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {

// Limits at which a file ends and the next begins, whichever is reached first.
struct SplitParams {
  std::int64_t max_bytes = 1'000'000'000;
  // Largest difference between the times of a file's first and next event, forward or back [us].
  std::int64_t max_us = 3'600'000'000;
};

// Writes events to a series of files in a folder: 000.lcmlog, 001.lcmlog, ... A new file has a
// number above all existing ones, so that an existing file is never changed.
class LogSeries {
 public:
  LogSeries(std::filesystem::path folder, SplitParams split);

  // Opens the next file and brings its name to the disk. Write() does this for the first event if
  // no file is open. Throws std::runtime_error "FILE: reason".
  void Open();
  // Throws as EventLogWriter::Write(): a log ends with a whole event, and is on the disk before the
  // next begins.
  void Write(const LogEvent& event);
  void Flush();
  // Ends the file if its path does not lead to it any more: it was deleted, or another file system
  // hides it. The next event opens a new one. False: it was so.
  bool CheckPlace();
  std::function<void()> Syncer() const;

  const std::filesystem::path& file() const { return path_; }  // written to now; empty: none yet
  std::int64_t events() const;                                 // in all logs since the start
  std::int64_t bytes() const;

 private:
  bool IsFull(const LogEvent& next) const;
  // Makes the dive's folder and the one in it where somebody deleted them; never the folder of the
  // dives. Throws if the disk is another one than at first: nothing is made below a mount point.
  void MakeFolder() const;

  const std::filesystem::path folder_;
  const SplitParams split_;
  std::filesystem::path path_;
  std::optional<EventLogWriter> log_;
  std::optional<FileIdentity> identity_;     // of log_
  std::optional<std::uint64_t> device_;      // that the folder was on at first
  std::optional<std::int64_t> first_utime_;  // in log_
  std::int64_t events_closed_ = 0;
  std::int64_t bytes_closed_ = 0;
};

}  // namespace seastitch
