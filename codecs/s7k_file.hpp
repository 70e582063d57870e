#pragma once

#include "codecs/s7k.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// A Teledyne .s7k file: records without network frames. 7000 with 7027 (pings), 1003, 1012, 1013,
// 1015, 1016 (navigation), 1009 (profile), 7030 (installation).
class S7kFileReader : public SurveyReader {
 public:
  // Besides those of every reader: those of S7kPings.
  Counters counters() const override;

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  // False: refused.
  bool ReadSensor(const S7kRecord& record, std::vector<SurveyRecord>* out);

  S7kPings pings_{std::chrono::seconds(2)};
};

}  // namespace seastitch
