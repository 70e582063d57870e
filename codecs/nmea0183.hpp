#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/counters.hpp"
#include "common/core/time.hpp"

// Sentences of NMEA 0183 and of the makers who write like it. A field that is empty, or no number,
// is not given; a sentence that lacks what it is for is nothing.
namespace seastitch {

struct NmeaSentence {
  std::string_view type;  // "GGA", whatever the talker; of makers' own the whole: "PSXN"
  std::vector<std::string_view> fields;

  std::string_view Text(std::size_t field) const {
    return field < fields.size() ? fields[field] : std::string_view();
  }
  std::optional<double> Number(std::size_t field) const;
};

// "$..." with its checksum, which may be left out where it need not be there (and by PSIMSSB, whose
// maker does). Counts nmea_malformed, nmea_checksum_wrong, nmea_checksum_missing.
std::optional<NmeaSentence> ParseNmea(std::string_view line,
                                      bool needs_checksum,
                                      Counters* counters);

// "hhmmss.ss"
std::optional<Duration> TimeOfDayFromNmea(std::string_view text);

struct GeoPoint {
  double latitude_rad = 0.0;  // WGS 84
  double longitude_rad = 0.0;
};

// Of GGA and, as far as it goes, RMC.
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

struct NmeaPosition {
  std::optional<Duration> time_of_day;
  FixQuality quality = FixQuality::kNone;
  std::optional<GeoPoint> position;
  std::optional<double> hdop;
  std::optional<double> height_m;  // above the ellipsoid
};
std::optional<NmeaPosition> DecodeGga(const NmeaSentence& sentence);

struct NmeaCourse {
  std::optional<Duration> time_of_day;
  std::optional<Time> midnight;      // of the day
  std::optional<GeoPoint> position;  // nothing: none, or called void
  std::optional<double> speed_mps;   // over ground
  std::optional<double> course_rad;  // over ground, from true north
};
std::optional<NmeaCourse> DecodeRmc(const NmeaSentence& sentence);
std::optional<NmeaCourse> DecodeVtg(const NmeaSentence& sentence);

// HDT and THS: from true north.
std::optional<double> DecodeHeading(const NmeaSentence& sentence);
// An instant, UTC.
std::optional<Time> DecodeZda(const NmeaSentence& sentence);

// Roll port up, pitch bow up.
struct NmeaAttitude {
  std::optional<Duration> time_of_day;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  std::optional<double> heading_rad;                        // from true north
  Eigen::Vector3d sigma_rpy_rad = Eigen::Vector3d::Zero();  // 1 sigma; 0 = not given
};
std::optional<NmeaAttitude> DecodePashr(const NmeaSentence& sentence);
std::optional<NmeaAttitude> DecodePrdid(const NmeaSentence& sentence);
std::optional<NmeaAttitude> DecodePsxn23(const NmeaSentence& sentence);

// 0 normal, 1 reduced, 2 invalid.
struct NmeaQuality {
  int horizontal = 0;
  int height = 0;
  int heading = 0;
  int roll_pitch = 0;
};
std::optional<NmeaQuality> DecodePsxn20(const NmeaSentence& sentence);

// Depth below the surface, from metres, else feet, else fathoms.
std::optional<double> DecodeDbs(const NmeaSentence& sentence);

// Kongsberg's acoustic positioning: where a transponder is.
struct Psimssb {
  std::optional<Duration> time_of_day;
  std::string transponder;  // "B01"
  bool valid = false;
  std::string error;                 // a valid one may have a doubt
  bool is_absolute = false;          // latitude and longitude; else as seen from the ship
  std::optional<GeoPoint> position;  // of absolute ones
  std::optional<double> accuracy_m;  // as expected, 1 sigma
};
std::optional<Psimssb> DecodePsimssb(const NmeaSentence& sentence);

}  // namespace seastitch
