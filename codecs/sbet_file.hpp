#pragma once

#include <optional>
#include <string>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Parameters that an SBET file does not hold.
struct SbetParams {
  Time week_start;           // Sunday midnight, GPS time, of the week of the first record
  double leap_seconds = 18;  // GPS time less UTC; 0 where the file was exported in UTC
  // True heading = platform heading + this times the wander angle: -1, 0 or 1.
  int wander_sign = 0;
  bool velocity_up = false;  // the third velocity is up rather than down

  std::string Validate() const;
};

// Applanix SBET: records of 17 doubles without marks. Samples "sbet": position, height, attitude,
// velocity.
class SbetFileReader : public SurveyReader {
 public:
  // Throws std::invalid_argument where params do not hold.
  explicit SbetFileReader(const SbetParams& params);

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  SbetParams params_;
  std::optional<double> last_s_;  // of the week
};

}  // namespace seastitch
