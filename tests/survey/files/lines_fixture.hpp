#pragma once

#include <gmock/gmock.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/message_types.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/placed_pings.hpp"
#include "tests/survey/files/read_all.hpp"

// Files of soundings by line beside a track, made of one survey, and how well they are mapped.
namespace seastitch {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

inline constexpr double kNoon_s = 1'777'723'200.0;  // 2026-05-02T12:00:00Z
inline constexpr double kLatitude = 57.1, kLongitude = 11.2;

struct Point {
  double t_s;               // since noon
  Eigen::Vector3d p_ned_m;  // about kLatitude, kLongitude; below the water line
  int line;
};

// A vehicle at 20 m of depth on three lines of 150 m, 30 m apart, to and fro at 2 m/s, with turns
// of 20 s. Its swath reaches 45 m to each side: over the lines beside it.
struct Vehicle {
  Eigen::Vector2d p_m;
  double heading_rad;
};
inline constexpr double kLineS = 75.0, kTurnS = 20.0;

inline Vehicle VehicleAt(double t_s) {
  const int line = std::clamp(static_cast<int>(t_s / (kLineS + kTurnS)), 0, 2);
  const double s = t_s - line * (kLineS + kTurnS);
  const double sign = line % 2 == 0 ? 1.0 : -1.0;
  const double begin = line % 2 == 0 ? 0.0 : 150.0;
  if (s <= kLineS || line == 2)
    return {{begin + sign * 2.0 * s, 30.0 * line + std::sin(0.05 * s)},
            sign > 0 ? 0.1 * std::sin(0.05 * s) : kPi - 0.1 * std::sin(0.05 * s)};
  const double angle = kPi * (s - kLineS) / kTurnS;
  const double from = 30.0 * line + std::sin(0.05 * kLineS);
  const double end = begin + sign * 150.0;
  return {{end + sign * 15.0 * std::sin(angle),
           from + 15.0 * (1.0 - std::cos(angle)) - std::sin(0.05 * kLineS) * angle / kPi},
          sign > 0 ? angle : kPi + angle};
}

inline std::vector<Point> Soundings() {
  std::vector<Point> points;
  for (int line = 0; line < 3; ++line)
    for (int ping = 0; ping < 150; ++ping) {
      const double t_s = line * (kLineS + kTurnS) + 0.5 * ping + 0.01;
      const Vehicle v = VehicleAt(t_s);
      for (int beam = -15; beam <= 15; ++beam) {
        const Eigen::Vector2d off =
            3.0 * beam * Eigen::Vector2d(-std::sin(v.heading_rad), std::cos(v.heading_rad));
        const Eigen::Vector2d p = v.p_m + off;
        points.push_back(
            {t_s, {p.x(), p.y(), 50.0 + std::sin(0.1 * p.x()) * std::cos(0.08 * p.y())}, line});
      }
    }
  return points;
}

inline const GeographicLib::LocalCartesian& Local() {
  static const GeographicLib::LocalCartesian local(kLatitude, kLongitude, 0.0);
  return local;
}
// Longitude, latitude.
inline Eigen::Vector2d Geographic(const Eigen::Vector2d& p_m) {
  double latitude = 0.0, longitude = 0.0, height = 0.0;
  Local().Reverse(p_m.y(), p_m.x(), 0.0, latitude, longitude, height);
  return {longitude, latitude};
}
inline Eigen::Vector2d Utm(const Eigen::Vector2d& p_m) {
  const Eigen::Vector2d place = Geographic(p_m);
  int zone = 0;
  bool north = false;
  double x = 0.0, y = 0.0;
  GeographicLib::UTMUPS::Forward(place.y(), place.x(), zone, north, x, y, 32);
  return {x, y};
}

struct TrackColumns {
  bool heading = true, attitude = true, depth = true, grid = false;
  double step_s = 0.2;
};

class SurveyLines : public ::testing::Test {
 protected:
  using Pick = std::function<bool(const Point&)>;
  static bool All(const Point&) { return true; }

  // Columns of numbers.
  fs::path Track(const TrackColumns& with = {}, double late_s = 0.0) {
    std::ostringstream text;
    text.precision(15);
    for (int i = 0; i * with.step_s <= 275.0; ++i) {
      const double t_s = -5.0 + with.step_s * i + 0.1 * with.step_s * (i % 2);
      const Vehicle v = VehicleAt(t_s);
      const Eigen::Vector2d p = with.grid ? Utm(v.p_m) : Geographic(v.p_m);
      text << kNoon_s + t_s + late_s << ',' << p.x() << ',' << p.y() << ",20,"
           << Rad2Deg(v.heading_rad) << ",1,2\n";
    }
    const std::string file = dir_.Write("track.csv", text.str());
    std::string columns = "columns:\n  - {quantity: epoch, column: 1}\n";
    const auto add = [&columns](const std::string& quantity, int column) {
      columns += "  - {quantity: " + quantity + ", column: " + std::to_string(column) + "}\n";
    };
    add(with.grid ? "east" : "longitude", 2);
    add(with.grid ? "north" : "latitude", 3);
    if (with.depth) add("depth", 4);
    if (with.heading) add("heading", 5);
    if (with.attitude) add("roll", 6), add("pitch", 7);
    dir_.Write("track.csv.yaml", columns + (with.grid ? "crs: EPSG:32632\n" : ""));
    return file;
  }

  enum class Times { kAdjusted, kWeek, kUtc };
  fs::path Las(const std::string& name,
               json spec,
               const Pick& pick = All,
               Times times = Times::kAdjusted,
               std::vector<Point> points = Soundings()) {
    json list = json::array();
    for (const Point& point : points) {
      if (!pick(point)) continue;
      const Eigen::Vector2d p = Utm(point.p_ned_m.head<2>());
      double gps_s = kNoon_s + point.t_s - 315'964'800.0;
      if (times != Times::kUtc) gps_s += 18.0;
      const double time_s = times == Times::kWeek ? std::fmod(gps_s, 604'800.0) : gps_s - 1e9;
      list.push_back({p.x(), p.y(), -point.p_ned_m.z(), time_s, 2, point.line + 1, 0, 0});
    }
    spec["points"] = list;
    spec["offset"] = {650'000.0, 6'330'000.0, 0.0};
    spec["adjusted"] = times != Times::kWeek;
    if (!spec.contains("epsg") && !spec.contains("none")) spec["epsg"] = 32632;
    const std::string input = dir_.Write("in.json", spec.dump());
    const fs::path file = dir_.path() / name;
    const auto written =
        RunCommand("python3 " + (SourceDir() / "tests/codecs/write_las.py").string() + " " +
                   file.string() + " < " + input);
    EXPECT_EQ(written.exit_code, 0) << written.output;
    return file;
  }

  CommandResult Replay(const std::string& inputs) const {
    return RunCommand(Program("seastitch") + " replay --quiet " + inputs + " --out " +
                      (dir_.path() / "map").string());
  }
  // One line and exit code 65.
  void ExpectRefused(const std::vector<fs::path>& files, const std::string& why) const {
    std::string inputs;
    for (const fs::path& file : files) inputs += " " + file.string();
    const auto result = Replay(inputs);
    EXPECT_EQ(result.exit_code, 65) << result.output;
    EXPECT_THAT(result.output, HasSubstr(why));
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  }

  TemporaryDir dir_;
};

struct Sounded {
  double t_s;
  Eigen::Vector3d p_ned_m;  // about kLatitude, kLongitude
};

struct Mapping {
  std::string text;
  Counters counters;
  std::vector<Sounded> soundings;
};

// Soundings as navigation and geometry of the mapper place them.
inline Mapping MappingOf(const std::vector<fs::path>& files) {
  PlacedSurvey placed = PlaceSurvey(files);
  const GeographicLib::LocalCartesian map(
      placed.datum_latitude_deg, placed.datum_longitude_deg, 0.0);
  Mapping mapping{std::move(placed.text), std::move(placed.counters), {}};
  for (const PlacedSoundings& ping : placed.pings)
    for (const Eigen::Vector3d& p : ping.p_map_m) {
      double latitude = 0.0, longitude = 0.0, height = 0.0, x = 0.0, y = 0.0, z = 0.0;
      map.Reverse(p.y(), p.x(), 0.0, latitude, longitude, height);
      Local().Forward(latitude, longitude, 0.0, x, y, z);
      mapping.soundings.push_back(
          {1e-6 * static_cast<double>(ToUtime(ping.time)) - kNoon_s, {y, x, p.z()}});
    }
  return mapping;
}

}  // namespace seastitch
