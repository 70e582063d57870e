#include "codecs/navigation/nmea0183.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "codecs/calendar.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kMetresPerFoot = 0.3048;
constexpr double kMetresPerFathom = 1.8288;

std::optional<int> Hex(std::string_view text) {
  int value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, 16);
  const bool usable = text.size() == 2 && error == std::errc() && stop == end && value >= 0;
  return usable ? std::optional(value) : std::nullopt;
}

bool IsName(std::string_view text) {
  for (const char c : text)
    if (!((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) return false;
  return text.size() >= 4;
}

std::optional<int> Integer(std::string_view text) {
  int value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  const bool usable = !text.empty() && error == std::errc() && stop == end;
  return usable ? std::optional(value) : std::nullopt;
}

// Angle from "dddmm.mmmm" and a letter, one of the two given.
std::optional<double> AngleRad(std::string_view number,
                               std::string_view letter,
                               std::string_view letters,
                               double most_deg) {
  const std::optional<double> value = ParseNumber(number);
  if (!value || *value < 0.0 || letter.size() != 1) return std::nullopt;
  const std::size_t side = letters.find(letter[0]);
  const double whole_deg = std::floor(*value / 100.0);
  const double minutes = *value - 100.0 * whole_deg;
  const double deg = whole_deg + minutes / 60.0;
  if (side == std::string_view::npos || minutes >= 60.0 || deg > most_deg) return std::nullopt;
  return Deg2Rad(side == 0 ? deg : -deg);
}

// Latitude and longitude from four fields, from `first` on.
std::optional<GeoPoint> PointAt(const NmeaSentence& s, std::size_t first) {
  const auto latitude = AngleRad(s.Text(first), s.Text(first + 1), "NS", 90.0);
  const auto longitude = AngleRad(s.Text(first + 2), s.Text(first + 3), "EW", 180.0);
  if (!latitude || !longitude) return std::nullopt;
  return GeoPoint{*latitude, *longitude};
}

std::optional<double> AngleFrom(const std::optional<double>& deg, double least, double most) {
  if (!deg || *deg < least || *deg > most) return std::nullopt;
  return Deg2Rad(*deg);
}
// A compass angle; some devices send -180 to 180.
std::optional<double> CompassRad(const NmeaSentence& s, std::size_t field) {
  return AngleFrom(s.Number(field), -180.0, 360.0);
}
std::optional<double> TiltRad(const NmeaSentence& s, std::size_t field) {
  return AngleFrom(s.Number(field), -90.0, 90.0);
}
std::optional<double> SpeedMps(const NmeaSentence& s, std::size_t field, double mps_per_unit) {
  const auto value = s.Number(field);
  if (!value || *value < 0.0) return std::nullopt;
  return *value * mps_per_unit;
}

std::optional<NmeaAttitude> AttitudeFrom(const NmeaSentence& s,
                                         std::size_t roll,
                                         std::size_t pitch,
                                         std::size_t heading) {
  const auto roll_rad = TiltRad(s, roll);
  const auto pitch_rad = TiltRad(s, pitch);
  if (!roll_rad || !pitch_rad) return std::nullopt;
  NmeaAttitude attitude;
  attitude.roll_rad = *roll_rad;
  attitude.pitch_rad = *pitch_rad;
  attitude.heading_rad = CompassRad(s, heading);
  return attitude;
}

double SigmaRad(const NmeaSentence& s, std::size_t field) {
  return AngleFrom(s.Number(field), 0.0, 180.0).value_or(0.0);
}

// Midnight of "ddmmyy" in this century.
std::optional<Time> DayFromNmea(std::string_view text) {
  if (text.size() != 6) return std::nullopt;
  const auto day = Integer(text.substr(0, 2));
  const auto month = Integer(text.substr(2, 2));
  const auto year = Integer(text.substr(4, 2));
  if (!day || !month || !year || *year < 0) return std::nullopt;
  return Midnight(2000 + *year, *month, *day);
}

}  // namespace

int NmeaChecksum(std::string_view text) {
  int sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  return sum;
}

std::optional<double> NmeaSentence::Number(std::size_t field) const {
  return ParseNumber(Trimmed(Text(field)));
}

std::optional<NmeaSentence> ParseNmea(std::string_view line,
                                      bool needs_checksum,
                                      Counters* counters) {
  const auto refuse = [counters](const char* why) {
    ++(*counters)[why];
    return std::nullopt;
  };
  line = Trimmed(line);
  if (!line.starts_with('$')) return refuse("nmea_malformed");
  line.remove_prefix(1);
  const std::size_t star = line.find('*');
  const std::string_view body = line.substr(0, star);
  NmeaSentence sentence;
  sentence.fields = Split(body, ',');
  const std::string_view address = sentence.fields.front();
  sentence.fields.erase(sentence.fields.begin());
  if (!IsName(address)) return refuse("nmea_malformed");
  const bool is_makers_own = address.starts_with('P');
  if (!is_makers_own && address.size() != 5) return refuse("nmea_malformed");
  sentence.type = is_makers_own ? address : address.substr(2);

  const std::string_view sum =
      star == std::string_view::npos ? std::string_view() : line.substr(star + 1);
  if (sum.empty()) {
    if (needs_checksum && sentence.type != "PSIMSSB") return refuse("nmea_checksum_missing");
  } else if (const auto stated = Hex(sum); !stated) {
    return refuse("nmea_malformed");
  } else if (*stated != NmeaChecksum(body)) {
    return refuse("nmea_checksum_wrong");
  }
  return sentence;
}

std::optional<Duration> TimeOfDayFromNmea(std::string_view text) {
  if (text.size() < 6) return std::nullopt;
  const auto hour = Integer(text.substr(0, 2));
  const auto minute = Integer(text.substr(2, 2));
  const auto second = ParseNumber(text.substr(4));
  if (!hour || !minute || !second || *hour < 0 || *hour > 23 || *minute < 0 || *minute > 59 ||
      *second < 0.0 || *second >= 61.0)
    return std::nullopt;
  return FromSeconds(3600.0 * *hour + 60.0 * *minute + *second);
}

std::optional<NmeaPosition> DecodeGga(const NmeaSentence& s) {
  NmeaPosition gga;
  gga.time_of_day = TimeOfDayFromNmea(s.Text(0));
  const auto quality = Integer(s.Text(5));
  if (!quality || *quality < 0 || *quality > 9) return std::nullopt;
  gga.quality = static_cast<FixQuality>(*quality);
  if (gga.quality == FixQuality::kNone) return gga;
  gga.position = PointAt(s, 1);
  if (!gga.position) return std::nullopt;
  gga.hdop = s.Number(7);
  const auto above_geoid_m = s.Number(8);
  const auto separation_m = s.Number(10);
  if (above_geoid_m && separation_m) gga.height_m = *above_geoid_m + *separation_m;
  return gga;
}

std::optional<NmeaCourse> DecodeRmc(const NmeaSentence& s) {
  NmeaCourse rmc;
  rmc.time_of_day = TimeOfDayFromNmea(s.Text(0));
  rmc.midnight = DayFromNmea(s.Text(8));
  if (s.Text(1) != "A") return s.Text(1) == "V" ? std::optional(rmc) : std::nullopt;
  rmc.position = PointAt(s, 2);
  if (!rmc.position) return std::nullopt;
  rmc.speed_mps = SpeedMps(s, 6, kMpsPerKnot);
  rmc.course_rad = CompassRad(s, 7);
  return rmc;
}

std::optional<NmeaCourse> DecodeVtg(const NmeaSentence& s) {
  if (s.Text(1) != "T" || s.Text(8) == "N") return std::nullopt;  // mode N: not valid
  NmeaCourse vtg;
  vtg.course_rad = CompassRad(s, 0);
  vtg.speed_mps = SpeedMps(s, 6, 1.0 / 3.6);
  if (const auto finer = SpeedMps(s, 4, kMpsPerKnot); finer) vtg.speed_mps = finer;
  return vtg.speed_mps ? std::optional(vtg) : std::nullopt;
}

std::optional<double> DecodeHeading(const NmeaSentence& s) {
  // THS has a mode: A autonomous, E estimated; M by hand, S simulated, V void.
  const bool usable = s.type == "THS" ? s.Text(1) == "A" || s.Text(1) == "E" : s.Text(1) == "T";
  return usable ? CompassRad(s, 0) : std::nullopt;
}

std::optional<Time> DecodeZda(const NmeaSentence& s) {
  const auto time_of_day = TimeOfDayFromNmea(s.Text(0));
  const auto day = Integer(s.Text(1));
  const auto month = Integer(s.Text(2));
  const auto year = Integer(s.Text(3));
  if (!time_of_day || !day || !month || !year) return std::nullopt;
  const auto midnight = Midnight(*year, *month, *day);
  if (!midnight) return std::nullopt;
  return *midnight + *time_of_day;
}

std::optional<NmeaAttitude> DecodePashr(const NmeaSentence& s) {
  auto attitude = AttitudeFrom(s, 3, 4, 1);
  if (!attitude || (s.Text(2) != "T" && attitude->heading_rad)) return std::nullopt;
  attitude->time_of_day = TimeOfDayFromNmea(s.Text(0));
  attitude->sigma_rpy_rad = {SigmaRad(s, 6), SigmaRad(s, 7), SigmaRad(s, 8)};
  return attitude;
}

std::optional<NmeaAttitude> DecodePrdid(const NmeaSentence& s) { return AttitudeFrom(s, 1, 0, 2); }

std::optional<NmeaAttitude> DecodePsxn23(const NmeaSentence& s) { return AttitudeFrom(s, 1, 2, 3); }

std::optional<NmeaQuality> DecodePsxn20(const NmeaSentence& s) {
  int values[4] = {};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto value = Integer(s.Text(i + 1));
    if (!value || *value < 0 || *value > 2) return std::nullopt;
    values[i] = *value;
  }
  return NmeaQuality{values[0], values[1], values[2], values[3]};
}

std::optional<double> DecodeDbs(const NmeaSentence& s) {
  if (const auto metres = s.Number(2); metres && s.Text(3) == "M") return metres;
  if (const auto feet = s.Number(0); feet && s.Text(1) == "f") return *feet * kMetresPerFoot;
  if (const auto fathoms = s.Number(4); fathoms && s.Text(5) == "F")
    return *fathoms * kMetresPerFathom;
  return std::nullopt;
}

std::optional<Psimssb> DecodePsimssb(const NmeaSentence& s) {
  Psimssb out;
  out.time_of_day = TimeOfDayFromNmea(s.Text(0));
  out.transponder = std::string(Trimmed(s.Text(1)));
  if (s.Text(2) != "A" && s.Text(2) != "V") return std::nullopt;
  out.valid = s.Text(2) == "A";
  out.error = std::string(Trimmed(s.Text(3)));
  const std::string_view system = s.Text(4);
  const bool is_degrees = system == "D";  // a letter follows each of the two angles
  out.is_absolute = is_degrees || system == "R";
  if (!out.valid || !out.is_absolute) return out;
  if (is_degrees) {
    out.position = PointAt(s, 7);
  } else if (const auto lat = s.Number(7), lon = s.Number(8);
             lat && lon && std::abs(*lat) <= std::numbers::pi / 2.0 &&
             std::abs(*lon) <= std::numbers::pi) {
    out.position = GeoPoint{*lat, *lon};
  }
  if (!out.position) return std::nullopt;
  const auto accuracy_m = s.Number(is_degrees ? 12 : 10);
  if (accuracy_m && *accuracy_m > 0.0) out.accuracy_m = accuracy_m;
  return out;
}

}  // namespace seastitch
