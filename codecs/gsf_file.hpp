#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// GSF 3.x (generic sensor format), big-endian: swath bathymetry as somebody processed it. A ping
// gives its position and attitude ("gsf_ping"), then its soundings; attitude records, profiles and
// processing parameters (settings). Depths have draft and tide in them already and count from the
// surface that these refer to; a beam whose flags mark it as ignored has no kBeamValid.
//
// Travel times and angles are left alone: in files that somebody has processed they do not lead to
// the depths beside them.
//
// Counts besides: gsf_version_unknown (records of a file that is not 3.x), gsf_compressed (pings
// whose arrays are).
class GsfFileReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  struct Scale {
    double multiplier = 0.0;  // 0: not given
    double offset = 0.0;
    bool compressed = false;
  };
  // Of a ping's arrays, by their number. They hold until the file gives others.
  using Scales = std::array<Scale, 32>;
  struct Arrays;

  // False: refused.
  bool ReadRecord(std::uint32_t type, Bytes data, std::vector<SurveyRecord>* out);
  bool ReadPing(Bytes data, std::vector<SurveyRecord>* out);
  bool ReadSubrecords(ByteReader* in, Arrays* arrays);
  bool ReadScales(Bytes subrecord);

  Scales scales_;
  bool known_version_ = true;
  std::uint32_t pings_ = 0;
};

}  // namespace seastitch
