#pragma once

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Triton XTF, little-endian, of an R2Sonic (as QINSy writes it): type 65 (BTH0 packets as on the
// wire), 3 (attitude), 107 (position). Lever arms and a sound-speed profile are not in it.
//
// Counts besides: xtf_position_not_geographic, where the file's positions are metres of a grid that
// it does not name.
class XtfFileReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  void ReadFileHeader(Bytes header);
  void ReadPing(Bytes packet, std::vector<SurveyRecord>* out);

  bool at_start_ = true;
  bool geographic_ = true;
};

}  // namespace seastitch
