#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "common/core/pose.hpp"
#include "survey/plan/survey_plan.hpp"
#include "survey/read/sbet_beside.hpp"

// What a SurveyPlan is, for people.
namespace seastitch {
namespace {

// The names of the files for which this holds: three, and the number of the others.
std::string Names(const std::vector<PlannedFile>& files,
                  const std::function<bool(const PlannedFile&)>& holds) {
  constexpr int kShown = 3;
  std::string text;
  int found = 0;
  for (const PlannedFile& file : files) {
    if (!holds(file) || ++found > kShown) continue;
    text += (found == 1 ? "" : ", ") + file.path.filename().string();
  }
  return found > kShown ? text + " and " + std::to_string(found - kShown) + " more" : text;
}

std::string Text(const char* name, const Eigen::Isometry3d& pose) {
  // Rounded as printed, plus 0: no "-0.000".
  const auto printed = [](const Eigen::Vector3d& v) {
    return Eigen::Vector3d((1000.0 * v).array().round() / 1000.0 + 0.0);
  };
  const Eigen::Vector3d p = printed(pose.translation());
  const Eigen::Vector3d rpy = printed(RpyFromRotation(pose.linear()) * (180.0 / kPi));
  char line[200];
  std::snprintf(line,
                sizeof line,
                "%s at %.3f forward, %.3f starboard, %.3f down [m], roll %.3f, pitch %.3f, yaw "
                "%.3f deg\n",
                name,
                p.x(),
                p.y(),
                p.z(),
                rpy.x(),
                rpy.y(),
                rpy.z());
  return line;
}

// A line about the delay that the installation states for a sensor; empty: none.
std::string DelayText(const InstalledSensor* sensor) {
  if (sensor == nullptr || sensor->delay_s == 0.0) return "";
  char line[120];
  std::snprintf(
      line,
      sizeof line,
      "    its stamps are late by %.3f s: %s\n",
      sensor->delay_s,
      sensor->delay_is_applied ? "corrected" : "not corrected (docs/survey-files-accuracy.md)");
  return line;
}

// A transmit array and its parts.
std::string Text(const char* name,
                 const Eigen::Isometry3d& array,
                 const std::vector<Eigen::Vector3d>& parts_m) {
  std::string text = Text(name, array);
  for (const Eigen::Vector3d& part_m : parts_m)
    text += Text("    a part of it", array * Eigen::Translation3d(part_m));
  return text;
}

// How soundings by line are read: a line of text for each way.
std::string LinesText(const std::vector<PlannedFile>& files) {
  std::set<std::string> ways;
  for (const PlannedFile& file : files) ways.insert(file.line_text);
  ways.erase("");
  std::string text;
  for (const std::string& way : ways) {
    const auto read_so = [&way](const PlannedFile& file) { return file.line_text == way; };
    text += "soundings by line: " + Names(files, read_so) + ": " + way + "\n";
  }
  return text;
}

// The three commonest types of records that no reader reads: "812 xtf_sonar, 3 xtf_notes". Records
// that cannot be read come first.
std::string Commonest(const Counters& not_read) {
  constexpr std::string_view kIgnored = "_ignored";
  std::vector<std::tuple<bool, std::int64_t, std::string>> by_count;
  for (const auto& [name, count] : not_read) {
    const std::size_t ignored = name.find(kIgnored);
    std::string type = name;
    if (ignored != std::string::npos) type.erase(ignored, kIgnored.size());
    by_count.emplace_back(ignored != std::string::npos, -count, type);
  }
  std::sort(by_count.begin(), by_count.end());
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(by_count.size(), 3); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(-std::get<1>(by_count[i])) + " " +
            std::get<2>(by_count[i]);
  return text;
}

}  // namespace

std::optional<std::string> SurveyPlan::Problem() const {
  const std::string these =
      files[0].path.string() + (files.size() > 1 ? " and those beside it" : "");
  if (!soundings)
    return these + ": no sounding in it" +
           (not_read.empty() ? "" : "; not read: " + Commonest(not_read));
  if (position_source.empty()) return these + ": no position in it to place soundings by";
  if (attitude_source.empty()) return these + ": no attitude in it to place soundings by";
  if (depth == SurveyPlan::Depth::kNone)
    return these + ": no heave and no depth in it to place soundings by";
  return std::nullopt;
}

std::string SurveyPlan::NamesOf(const std::function<bool(const PlannedFile&)>& holds) const {
  return Names(files, holds);
}

std::string SurveyPlan::Text() const {
  const auto or_none = [](const std::string& text) { return text.empty() ? "none" : text; };
  const char* const depths[] = {
      "none", "heave and water line", "of the navigation", "of the sonar, by ping"};
  std::string text = "position: " + or_none(position_source) +
                     ", attitude: " + or_none(attitude_source) +
                     (heading_source.empty() ? "" : " with heading of " + heading_source) +
                     ", depth: " + depths[static_cast<int>(depth)] + ", pings: " +
                     (!soundings  ? "none"
                      : raw_pings ? "raw times and angles"
                                  : "soundings as they were placed") +
                     "\n";
  const std::string utc = Names(files, [](const PlannedFile& f) {
    return IsSbet(f.path) && f.params.sbet.leap_seconds == 0.0;
  });
  if (!utc.empty())
    text += "times are UTC, not GPS, as the files' own positions show: " + utc + "\n";
  if (grid_origin_m) {
    char line[160];
    std::snprintf(
        line,
        sizeof line,
        "positions are of a grid without a name: its point %.3f north, %.3f east stands at "
        "latitude and longitude 0\n",
        grid_origin_m->x(),
        grid_origin_m->y());
    text += line;
  }
  text += LinesText(files);
  return text + sound_speed_text + profile_text + InstallationText();
}

std::string SurveyPlan::InstallationText() const {
  if (!has_installation)
    return raw_pings ? "no installation parameters: the vehicle.yaml of --config applies; without "
                       "one, sonar, INS and reference point are taken to be at one place\n"
                     : "no installation parameters: soundings are relative to the position\n";
  std::string text = "installation of " + installation.model + ":\n";
  text += seastitch::Text("  transmitter", vehicle.T_mbes_tx, vehicle.p_tx_parts_m);
  text += seastitch::Text("  receiver", vehicle.T_mbes_rx);
  for (const SonarHead& head : vehicle.more_heads) {
    text += seastitch::Text("  next transmitter", head.T_mbes_tx, head.p_tx_parts_m);
    text += seastitch::Text("  next receiver", head.T_mbes_rx);
  }
  text += seastitch::Text("  position sensor", vehicle.T_vehicle_imu);
  text += DelayText(SensorOf(position_source));
  if (const InstalledSensor* const motion = SensorOf(attitude_source))
    text += seastitch::Text("  motion sensor", motion->T_vehicle_sensor) + DelayText(motion);
  char line[80];
  std::snprintf(line, sizeof line, "  water line %.3f m down\n", installation.water_line_m);
  text += line;
  double water_line_m = installation.water_line_m;
  for (const PlannedFile& file : files) {
    if (!file.installation || file.is_installed_otherwise ||
        file.installation->water_line_m == water_line_m)
      continue;
    water_line_m = file.installation->water_line_m;
    std::snprintf(line, sizeof line, "  water line %.3f m down from ", water_line_m);
    text += line + file.path.filename().string() + " on\n";
  }
  return text;
}

}  // namespace seastitch
