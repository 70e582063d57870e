#pragma once

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of AUVLIB files: std_data::mbes_ping::PingsT in cereal's binary or portable binary archive
// (little-endian). Each ping gives its pose (source "auvlib"), in a map grid that the file does not
// name, and its points.
class CerealFileReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  bool at_start_ = true;
};

}  // namespace seastitch
