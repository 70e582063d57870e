#include "products/files/navigation_files.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "common/core/bytes.hpp"
#include "common/core/pose.hpp"
#include "common/geo/map_frame.hpp"

namespace seastitch {
namespace {

constexpr double kMaxStepS = 1.0;

double Heading_deg(const GeographicState& s) {
  const double deg = Rad2Deg(s.rpy_rad.z());
  return deg < 0.0 ? deg + 360.0 : deg;
}

// GPS time less UTC.
int LeapSeconds(Time time) {
  using namespace std::chrono;
  constexpr std::array<sys_days, 18> kSince{sys_days(1981y / 7 / 1),
                                            sys_days(1982y / 7 / 1),
                                            sys_days(1983y / 7 / 1),
                                            sys_days(1985y / 7 / 1),
                                            sys_days(1988y / 1 / 1),
                                            sys_days(1990y / 1 / 1),
                                            sys_days(1991y / 1 / 1),
                                            sys_days(1992y / 7 / 1),
                                            sys_days(1993y / 7 / 1),
                                            sys_days(1994y / 7 / 1),
                                            sys_days(1996y / 1 / 1),
                                            sys_days(1997y / 7 / 1),
                                            sys_days(1999y / 1 / 1),
                                            sys_days(2006y / 1 / 1),
                                            sys_days(2009y / 1 / 1),
                                            sys_days(2012y / 7 / 1),
                                            sys_days(2015y / 7 / 1),
                                            sys_days(2017y / 1 / 1)};
  const auto day = time.time_since_epoch();
  return static_cast<int>(std::count_if(
      kSince.begin(), kSince.end(), [day](sys_days d) { return d.time_since_epoch() <= day; }));
}

struct Calendar {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0;
  double second = 0.0;
};

Calendar CalendarOf(Time time) {
  using namespace std::chrono;
  const auto since = time.time_since_epoch();
  const auto days_since = floor<days>(since);
  const year_month_day date{sys_days(days_since)};
  const auto of_day = since - days_since;
  const auto minutes_of_day = floor<minutes>(of_day);
  Calendar c;
  c.year = static_cast<int>(date.year());
  c.month = static_cast<int>(static_cast<unsigned>(date.month()));
  c.day = static_cast<int>(static_cast<unsigned>(date.day()));
  c.hour = static_cast<int>(minutes_of_day.count() / 60);
  c.minute = static_cast<int>(minutes_of_day.count() % 60);
  c.second = ToSeconds(of_day - minutes_of_day);
  return c;
}

}  // namespace

std::vector<GeographicState> ToGeographic(const std::vector<CorrectedState>& track,
                                          const Datum& datum) {
  const MapFrame map(datum);
  const auto place = [&track](std::size_t i) {
    const CorrectedState& s = track[i];
    return Eigen::Vector3d(s.corrected.x, s.corrected.y, s.p_dead_reckoned.z());
  };
  const auto near = [&track](std::size_t a, std::size_t b) {
    return track[a].chain == track[b].chain &&
           ToSeconds(track[b].time - track[a].time) <= kMaxStepS;
  };
  std::vector<GeographicState> out;
  out.reserve(track.size());
  for (std::size_t i = 0; i < track.size(); ++i) {
    const CorrectedState& s = track[i];
    const Eigen::Vector3d p = place(i);
    const Datum point = map.PointAt(p.head<2>(), p.z());
    GeographicState state{
        {Deg2Rad(point.latitude_deg), Deg2Rad(point.longitude_deg)}, s.time, p.z()};
    state.rpy_rad << s.rpy_dead_reckoned_rad.head<2>(), WrapAngle(s.corrected.yaw);
    const std::size_t before = i > 0 && near(i - 1, i) ? i - 1 : i;
    const std::size_t after = i + 1 < track.size() && near(i, i + 1) ? i + 1 : i;
    if (before < after)
      state.v_ned_mps =
          (place(after) - place(before)) / ToSeconds(track[after].time - track[before].time);
    state.sigma = s.sigma;
    out.push_back(state);
  }
  return out;
}

std::string IsoTime(Time time) {
  const Calendar c = CalendarOf(time);
  char text[64];
  std::snprintf(text,
                sizeof text,
                "%04d-%02d-%02dT%02d:%02d:%09.6fZ",
                c.year,
                c.month,
                c.day,
                c.hour,
                c.minute,
                c.second);
  return text;
}

double GpsSeconds(Time time) {
  return ToSeconds(time - kGpsEpoch + std::chrono::seconds(LeapSeconds(time)));
}

std::string NavigationCsv(const std::vector<GeographicState>& track) {
  std::string out = std::string(kNavigationCsvHeading) + "\n";
  char line[240];
  for (const GeographicState& s : track) {
    std::snprintf(line,
                  sizeof line,
                  "%s,%.9f,%.9f,%.3f,%.4f,%.4f,%.4f,",
                  IsoTime(s.time).c_str(),
                  Rad2Deg(s.latitude_rad),
                  Rad2Deg(s.longitude_rad),
                  s.depth_m,
                  Heading_deg(s),
                  Rad2Deg(s.rpy_rad.x()),
                  Rad2Deg(s.rpy_rad.y()));
    out += line;
    if (s.sigma)
      std::snprintf(
          line, sizeof line, "%.3f,%.3f,%.4f\n", s.sigma->x(), s.sigma->y(), Rad2Deg(s.sigma->z()));
    out += s.sigma ? line : ",,\n";
  }
  return out;
}

std::string SbetBytes(const std::vector<GeographicState>& track) {
  ByteWriter out;
  for (const GeographicState& s : track) {
    const double heading_rad = Deg2Rad(Heading_deg(s));
    for (const double number : {std::fmod(GpsSeconds(s.time), kGpsWeekS),
                                s.latitude_rad,
                                s.longitude_rad,
                                -s.depth_m,
                                s.v_ned_mps.x(),
                                s.v_ned_mps.y(),
                                s.v_ned_mps.z(),
                                s.rpy_rad.x(),
                                s.rpy_rad.y(),
                                heading_rad})
      out.Le(number);
    for (int zero = 0; zero < 7; ++zero) out.Le(0.0);  // wander, accelerations, rates
  }
  return {out.bytes().begin(), out.bytes().end()};
}

std::string Na0Text(const std::vector<GeographicState>& track) {
  std::string out =
      "## year month day hour minute second epoch_s longitude latitude heading speed_kmh draft "
      "roll pitch heave zoffset\r\n";
  char line[240];
  for (const GeographicState& s : track) {
    const Calendar c = CalendarOf(s.time);
    std::snprintf(line,
                  sizeof line,
                  "%04d %02d %02d %02d %02d %09.6f %.6f %.9f %.9f %.4f %.4f %.3f %.4f %.4f 0.000 "
                  "0.000\r\n",
                  c.year,
                  c.month,
                  c.day,
                  c.hour,
                  c.minute,
                  c.second,
                  1e-6 * static_cast<double>(ToUtime(s.time)),
                  Rad2Deg(s.longitude_rad),
                  Rad2Deg(s.latitude_rad),
                  Heading_deg(s),
                  3.6 * s.v_ned_mps.head<2>().norm(),
                  s.depth_m,
                  Rad2Deg(s.rpy_rad.x()),
                  Rad2Deg(s.rpy_rad.y()));
    out += line;
  }
  return out;
}

}  // namespace seastitch
