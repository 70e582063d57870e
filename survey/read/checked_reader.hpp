#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Finds pings and navigation records whose stamps do not fit those around them in the file, such as
// a time of 0 while the receiver has no fix.
//
// A *run* is a row of records whose stamps differ by at most a minute from one to the next. A file
// that returns from a run to the time before it shows that the run is wrong, unless the run is the
// longer one. Of a run at the beginning or end of a file nothing shows that: it is left out if it
// is later than what follows (earlier than what went before), or if it is short and half a day
// apart.
//
// The first kSure records of a run are held until it is clear whether they are used.
class StampCheck {
 public:
  void Add(SurveyRecord record, std::vector<SurveyRecord>* out);
  void Finish(std::vector<SurveyRecord>* out);
  std::int64_t left_out() const { return left_out_; }
  std::int64_t pings_left_out() const { return pings_left_out_; }

 private:
  // Longer than a datagram of motion, which a wrong clock stamps as a whole.
  static constexpr std::size_t kSure = 200;
  static constexpr std::size_t kMostRuns = 100;

  struct Run {
    Time first, last;
    std::size_t records = 0;
    std::vector<SurveyRecord> held{};
  };

  void Append(SurveyRecord record, Run* run);
  bool IsBeside(const Run& run, const Run& sure) const;
  void Release(Run* run, std::vector<SurveyRecord>* out);
  void Settle(std::size_t sure, std::vector<SurveyRecord>* out);
  void LeaveOut(const SurveyRecord& record);
  void LeaveOut(const Run& run) {
    for (const SurveyRecord& record : run.held) LeaveOut(record);
  }

  std::vector<Run> runs_;  // in the order of the file; the first may be released already
  std::int64_t left_out_ = 0;
  std::int64_t pings_left_out_ = 0;
};

// Finds pings whose stamps jump by more than 5 s and come back: the clock of the sonar was wrong
// for some pings. Pings after a jump are held until one comes back, or until they go on for 10 s.
class PingJumpCheck {
 public:
  void Add(SurveyRecord record, std::vector<SurveyRecord>* out);
  void Finish(std::vector<SurveyRecord>* out);
  std::int64_t left_out() const { return left_out_; }

 private:
  bool HasComeBack(Time t) const;

  std::optional<Time> last_;        // of the last ping given
  std::vector<SurveyRecord> held_;  // since a jump
  std::int64_t left_out_ = 0;
};

// The records of a reader, without stamps that do not fit (survey_stamps_far_off) and without
// positions at latitude and longitude 0, which mean that there is none (survey_positions_at_zero).
class CheckedReader {
 public:
  // clock_offsets_s: taken off the stamps of navigation, by source.
  explicit CheckedReader(std::unique_ptr<SurveyReader> reader,
                         std::map<std::string, double> clock_offsets_s = {})
      : reader_(std::move(reader)), clock_offsets_s_(std::move(clock_offsets_s)) {}

  std::vector<SurveyRecord> Add(Bytes bytes);
  std::vector<SurveyRecord> Finish();
  Counters counters() const;
  const std::string& problem() const { return reader_->problem(); }
  std::uint64_t missing() const { return reader_->missing(); }
  std::int64_t late() const { return reader_->late(); }
  // By their stamps.
  std::int64_t pings_left_out() const { return stamps_.pings_left_out() + jumps_.left_out(); }

 private:
  std::vector<SurveyRecord> Checked(std::vector<SurveyRecord> records);

  std::unique_ptr<SurveyReader> reader_;
  const std::map<std::string, double> clock_offsets_s_;
  StampCheck stamps_;
  PingJumpCheck jumps_;
  std::int64_t at_zero_ = 0;
};

}  // namespace seastitch
