#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/storage/event_log.hpp"
#include "survey/progress.hpp"
#include "survey/read/recorded_dive.hpp"

namespace seastitch {

// An EventLogReader::Wanted: all of every message but those with a device's bytes (RAW_*), of which
// it wants the beginning.
std::size_t WithoutRawBytes(const std::string& channel);

// The events of a replay's logs in one sequence. Events of one recorder keep their order. Several
// recorders are merged by log time. A time that goes back within a recorder counts as the largest
// before it.
class MergedLogs {
 public:
  // wanted: as in EventLogReader, whose errors it throws.
  MergedLogs(const RecordedLogs& logs, EventLogReader::Wanted wanted, bool quiet);
  ~MergedLogs();

  std::optional<LogEvent> Next();
  // Log of the last event, numbered from 0 over all recorders in the given order.
  std::size_t log() const { return log_; }
  // Percentage of the bytes read so far.
  int percent_read() const;
  // Counts of what was skipped, by reason: "damaged_bytes", and "doubled_CHANNEL" for messages that
  // another recorder had, too.
  std::map<std::string, std::int64_t> refused() const;

 private:
  class Recorder;
  class DuplicateFilter;

  std::vector<std::unique_ptr<Recorder>> recorders_;
  std::unique_ptr<DuplicateFilter> duplicates_;
  std::size_t log_ = 0;
  std::uint64_t total_ = 0;
  std::uint64_t read_ = 0;
  ProgressLine progress_;
};

}  // namespace seastitch
