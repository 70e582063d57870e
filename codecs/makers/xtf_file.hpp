#pragma once

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of Triton XTF files of an R2Sonic, little-endian, as QINSy writes them: packet types 65
// (BTH0 as on the wire; also type 68 with a BTH0 at the same place), 3 (attitude), 107 (position).
// The files have no lever arms and no sound-speed profile. A ping has the sonar's time; that of the
// packet where they differ by more than kMaxStampError (stamps_wrong).
//
// Also counts xtf_position_not_geographic: the file's positions are metres of a grid that it does
// not name.
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
