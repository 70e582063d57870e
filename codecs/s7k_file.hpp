#pragma once

#include "codecs/s7k.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of a Teledyne .s7k file: records without network frames. 7000 with 7027 (pings), 1003
// (position), 1012 (roll, pitch, heave), 1013 (heading), 1015 (navigation), 1016 (attitude), 1009
// (sound-speed profile), 7030 (installation).
class S7kFileReader : public SurveyReader {
 public:
  // Counters of every reader and of S7kPings.
  Counters counters() const override;

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  // False: malformed.
  bool ReadSensor(const S7kRecord& record, std::vector<SurveyRecord>* out);

  S7kPings pings_{std::chrono::seconds(2)};
};

}  // namespace seastitch
