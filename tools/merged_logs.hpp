#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/storage/event_log.hpp"
#include "tools/progress.hpp"
#include "tools/recorded_dive.hpp"

namespace seastitch {

// The events of a replay's logs, one after another: of one recorder in its own order, of several by
// the time of the log, which never falls within a recorder.
class MergedLogs {
 public:
  // Throws std::runtime_error as EventLogReader.
  MergedLogs(const RecordedLogs& logs, bool quiet);
  ~MergedLogs();

  std::optional<LogEvent> Next();
  // Of the last event, by number from 0: recorder by recorder as they were given.
  std::size_t log() const { return log_; }
  // In per cent of the bytes.
  int percent_read() const;
  // What was passed over, by reason: "damaged_bytes", and "doubled_CHANNEL" for a message that
  // another recorder, too, had.
  std::map<std::string, std::int64_t> refused() const;

 private:
  class Recorder;
  class Doubles;

  std::vector<std::unique_ptr<Recorder>> recorders_;
  std::unique_ptr<Doubles> doubles_;
  std::size_t log_ = 0;
  std::uint64_t total_ = 0;
  std::uint64_t read_ = 0;
  ProgressLine progress_;
};

}  // namespace seastitch
