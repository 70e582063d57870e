#pragma once

#include <filesystem>

#include "common/convert/convert.hpp"
#include "common/core/health/counters.hpp"
#include "products/survey_collector.hpp"
#include "survey/read/merged_logs.hpp"
#include "survey/read/message_types.hpp"

namespace seastitch {

// Hands the results of mapper and optimizer that were recorded in logs to a collector.
class RecordedResults {
 public:
  // Throws std::runtime_error as EventLogReader.
  RecordedResults(const RecordedLogs& recorded, bool quiet, SurveyCollector* collector);

  // Reads an event. False: there was none. At the end throws DataError if there was no result.
  bool Next();
  int percent_read() const { return logs_.percent_read(); }
  // What was not used, by reason.
  Counters refused() const;

 private:
  void Use(const LogEvent& event);

  const std::filesystem::path first_log_;
  MergedLogs logs_;
  SurveyCollector* const collector_;
  MessageTypes types_;
  SubmapAssembler submaps_;
  PoseGraphAssembler graphs_;
  bool any_ = false;
};

}  // namespace seastitch
