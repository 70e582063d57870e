#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "common/convert/message_inbox.hpp"
#include "survey/read/merged_logs.hpp"
#include "survey/read/message_types.hpp"
#include "survey/read/raw_replay.hpp"
#include "survey/read/recorded_dive.hpp"
#include "survey/read/sample_source.hpp"

namespace seastitch {

// The samples of a dive's logs. Messages of another type than that of their channel are skipped and
// counted by reason.
class LogSource : public SampleSource {
 public:
  // raw: decodes the recorded raw bytes; null: they are not decoded. Throws std::runtime_error as
  // EventLogReader.
  LogSource(const RecordedLogs& recorded, std::unique_ptr<RawReplay> raw, bool quiet);

  // At the end throws DataError if no event was on a channel that a replay reads.
  std::optional<Received> Next() override;
  std::size_t input() const override { return logs_.log(); }
  int percent_read() const override { return logs_.percent_read(); }
  Counters refused() const override;
  std::vector<Condition> conditions() const override;
  // What was lost or is malformed.
  Counters messages() const { return inbox_.counters(); }

 private:
  // The sample of an event. Absent: it is not read, malformed, or raw bytes, whose samples Next()
  // takes.
  std::optional<Received> Use(const LogEvent& event);

  const std::filesystem::path first_log_;
  MergedLogs logs_;
  const std::unique_ptr<RawReplay> raw_;
  MessageInbox inbox_;
  MessageTypes types_;
  double now_s_ = 0.0;  // time of the last event in the log
  bool any_ = false;
  bool ended_ = false;
};

}  // namespace seastitch
