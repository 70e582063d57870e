#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of GSF 3.x files (generic sensor format), big-endian: processed swath bathymetry. A ping
// gives its position and attitude (source "gsf_ping"), then its soundings. Also read: attitude
// records, sound-speed profiles, processing parameters (as settings). Depths include the
// corrections of draft and tide and count from the surface that these refer to. A beam that is
// flagged as ignored has no kBeamValid.
//
// Travel times and angles are not read: in processed files they do not agree with the depths.
//
// Versions 1 to 3: up to 2.x a ping's head ends before height and separation. Also counts
// gsf_version_unknown (records of a file of another version), gsf_compressed (pings with compressed
// arrays, which are not read) and gsf_ping_without_depths (whose position is read).
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
  // Scale factors of a ping's arrays, by array number. Valid until the file states others.
  using Scales = std::array<Scale, 32>;
  struct Arrays;

  // False: malformed.
  bool ReadRecord(std::uint32_t type, Bytes data, std::vector<SurveyRecord>* out);
  bool ReadPing(Bytes data, std::vector<SurveyRecord>* out);
  bool ReadSubrecords(ByteReader* in, Arrays* arrays);
  bool ReadScales(Bytes subrecord);

  Scales scales_;
  int version_ = 3;  // 0: not known
  std::uint32_t pings_ = 0;
};

}  // namespace seastitch
