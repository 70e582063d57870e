#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/geo_point.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/time.hpp"

// Decoders of NMEA 0183 sentences, standard and proprietary. A field that is empty or not a number
// is absent. A sentence without the field that it is sent for gives std::nullopt. Headings and
// courses are clockwise from true north [rad].
namespace seastitch {

struct NmeaSentence {
  // Without the two letters of the talker: "GGA". Of a proprietary sentence the whole: "PSXN".
  std::string_view type;
  std::vector<std::string_view> fields;

  std::string_view Text(std::size_t field) const {
    return field < fields.size() ? fields[field] : std::string_view();
  }
  std::optional<double> Number(std::size_t field) const;
};

inline constexpr double kMpsPerKnot = 1852.0 / 3600.0;

// Checksum of the text between $ and *: the exclusive or of its bytes.
int NmeaChecksum(std::string_view text);

// Splits one line "$..." and checks its checksum. needs_checksum: a line without a checksum is
// rejected, except PSIMSSB, which its maker sends without. A wrong checksum is always rejected.
// Counts nmea_malformed, nmea_checksum_wrong, nmea_checksum_missing in *counters (not null).
std::optional<NmeaSentence> ParseNmea(std::string_view line,
                                      bool needs_checksum,
                                      Counters* counters);

// Time since midnight UTC from "hhmmss.ss".
std::optional<Duration> TimeOfDayFromNmea(std::string_view text);

// Quality of a GGA position, numbers as in the sentence.
enum class FixQuality : int {
  kNone = 0,
  kAutonomous = 1,
  kDifferential = 2,
  kPrecise = 3,
  kRtkFixed = 4,
  kRtkFloat = 5,
  kEstimated = 6,  // dead reckoning of the receiver
  kManual = 7,
  kSimulated = 8,
};

// Sigma of north and east each that an HDOP of 1 stands for, unless a receiver says otherwise [m].
inline constexpr double kGpsSigmaAtHdop1M = 3.0;

struct NmeaPosition {
  std::optional<Duration> time_of_day;
  FixQuality quality = FixQuality::kNone;
  std::optional<GeoPoint> position;
  std::optional<double> hdop;
  // Above the WGS 84 ellipsoid: altitude plus geoid separation, where the sentence has both.
  std::optional<double> height_m;
};
std::optional<NmeaPosition> DecodeGga(const NmeaSentence& sentence);

struct NmeaCourse {
  std::optional<Duration> time_of_day;
  std::optional<Time> midnight;      // of the day
  std::optional<GeoPoint> position;  // absent in VTG and where RMC has status V (void)
  std::optional<double> speed_mps;   // over ground
  std::optional<double> course_rad;  // over ground, from true north
};
std::optional<NmeaCourse> DecodeRmc(const NmeaSentence& sentence);
std::optional<NmeaCourse> DecodeVtg(const NmeaSentence& sentence);

// Heading of HDT and THS.
std::optional<double> DecodeHeading(const NmeaSentence& sentence);
// Date and time of ZDA, UTC.
std::optional<Time> DecodeZda(const NmeaSentence& sentence);

// Attitude: roll positive port side up, pitch positive bow up, as all three sentences have it.
struct NmeaAttitude {
  std::optional<Duration> time_of_day;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  std::optional<double> heading_rad;                        // absent where not stated
  Eigen::Vector3d sigma_rpy_rad = Eigen::Vector3d::Zero();  // 1 sigma; 0 = not given
};
std::optional<NmeaAttitude> DecodePashr(const NmeaSentence& sentence);
std::optional<NmeaAttitude> DecodePrdid(const NmeaSentence& sentence);
std::optional<NmeaAttitude> DecodePsxn23(const NmeaSentence& sentence);

// Quality of a motion sensor's outputs (PSXN,20): 0 normal, 1 reduced, 2 invalid.
struct NmeaQuality {
  int horizontal = 0;
  int height = 0;
  int heading = 0;
  int roll_pitch = 0;
};
std::optional<NmeaQuality> DecodePsxn20(const NmeaSentence& sentence);

// Depth below the surface [m] of DBS, from its field in metres, else in feet, else in fathoms.
std::optional<double> DecodeDbs(const NmeaSentence& sentence);

// Position of a transponder by Kongsberg's acoustic positioning (USBL).
struct Psimssb {
  std::optional<Duration> time_of_day;
  std::string transponder;  // "B01"
  bool valid = false;
  std::string error;         // error code; a valid position may have one, too
  bool is_absolute = false;  // latitude and longitude; else relative to the ship, and not decoded
  std::optional<GeoPoint> position;  // where valid and absolute
  std::optional<double> accuracy_m;  // expected horizontal 1 sigma
};
std::optional<Psimssb> DecodePsimssb(const NmeaSentence& sentence);

}  // namespace seastitch
