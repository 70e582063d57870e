#pragma once

#include <optional>
#include <string>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Properties of an SBET file that the file itself does not state.
struct SbetParams {
  Time week_start;           // Sunday midnight, GPS time, of the week of the first record
  double leap_seconds = 18;  // GPS time less UTC; 0 where the file was exported in UTC
  // Sign of the wander angle: true heading = platform heading + wander_sign * wander angle. -1, 0
  // or 1; programs that write SBET differ.
  int wander_sign = 0;
  bool velocity_up = false;  // the third velocity is up rather than down

  std::string Validate() const;
};

// Reader of an Applanix SBET: records of 17 doubles without any header. Gives NavigationRecords of
// source "sbet": position, height, attitude, velocity.
class SbetFileReader : public SurveyReader {
 public:
  // Throws std::invalid_argument where params are out of range.
  explicit SbetFileReader(const SbetParams& params);

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  SbetParams params_;
  std::optional<double> last_s_;  // time of the last record, in seconds of the first one's week
};

}  // namespace seastitch
