#pragma once

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of AUVLIB files: std_data::mbes_ping::PingsT in cereal's binary or portable binary archive
// (little-endian). Each ping gives its pose (source "auvlib"), in a map grid that the file does not
// name, and its points. Pings with one stamp in whole seconds are spread evenly over that second.
//
// Also counts cereal_stamp_stands_still: pings of one stamp beyond a thousand.
class CerealFileReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;
  void End(std::vector<SurveyRecord>* out) override;

 private:
  struct Ping {
    NavigationRecord pose;
    PlacedPing soundings;
  };
  void Spread(std::vector<SurveyRecord>* out);  // over their second

  bool at_start_ = true;
  std::vector<Ping> same_stamp_;  // waiting for the next stamp
};

}  // namespace seastitch
