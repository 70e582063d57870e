#pragma once

#include "codecs/survey_reader.hpp"

namespace seastitch {

// AUVLIB's std_data::mbes_ping::PingsT as cereal's binary archive has it, or its portable one
// (little-endian): for each ping the pose ("auvlib"), in an unnamed map grid, and its points.
class CerealFileReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  bool at_start_ = true;
};

}  // namespace seastitch
