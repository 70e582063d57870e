#include "products/track/survey_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "products/files/navigation_files.hpp"

namespace seastitch {
namespace {

bool GoesOn(SubmapTrigger trigger) {
  return trigger == SubmapTrigger::kInformation || trigger == SubmapTrigger::kLength;
}

std::string Metres(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

// Distance along the track as navigated.
struct Travelled {
  double all_m = 0.0;
  double straight_m = 0.0;  // without turns
};

// A turn is where the heading changes by more than 1 degree a second in the mean of 10 s: an AUV's
// or a ship's turn, but no wave. Nothing without a track.
std::optional<Travelled> TravelledIn(const Survey& survey,
                                     const std::pair<Time, Time>& times,
                                     std::int32_t chain) {
  constexpr double kHalfS = 5.0;
  constexpr double kTurning = Deg2Rad(1.0);  // [rad/s]
  const auto at = [&](Time time) {
    return std::lower_bound(survey.track.begin(),
                            survey.track.end(),
                            std::pair(chain, time),
                            [](const TrackState& s, const std::pair<std::int32_t, Time>& t) {
                              return std::pair(s.chain, s.time) < t;
                            });
  };
  Travelled sum;
  const auto begin = at(times.first), end = at(times.second);
  if (begin == survey.track.end() || end - begin < 2) return std::nullopt;
  for (auto state = begin; state + 1 != end; ++state) {
    const double step_m = ((state + 1)->p_map - state->p_map).head<2>().norm();
    const auto before = at(state->time - FromSeconds(kHalfS));
    auto after = at(state->time + FromSeconds(kHalfS));
    if (after == survey.track.end() || after->chain != chain) --after;
    const double elapsed_s = ToSeconds(after->time - before->time);
    const double turned = WrapAngle(after->rpy_rad.z() - before->rpy_rad.z());
    sum.all_m += step_m;
    if (elapsed_s <= 0.0 || std::abs(turned) <= kTurning * elapsed_s) sum.straight_m += step_m;
  }
  return sum;
}

// What the graph did to one line.
struct Shift {
  Pose2 frame;  // dead-reckoned, of the submap in its middle
  double length_m = 0.0;
  Eigen::Vector2d moved = Eigen::Vector2d::Zero();
  double turned_rad = 0.0;
  std::optional<Eigen::Vector3d> sigma = Eigen::Vector3d::Zero();
};

Shift ShiftOf(const SurveyLine& line,
              const SurveyPoses& dead_reckoned,
              const SurveyPoses& delivered,
              const std::vector<std::optional<Eigen::Vector3d>>& sigmas) {
  Shift shift;
  const double n = static_cast<double>(line.last - line.first + 1);
  shift.frame = dead_reckoned.T_map_level[(line.first + line.last) / 2];
  for (std::size_t i = line.first; i <= line.last; ++i) {
    const Pose2& before = dead_reckoned.T_map_level[i];
    const Pose2 after = delivered.VehicleAt(i);
    shift.moved += (after.Translation() - before.Translation()) / n;
    shift.turned_rad += WrapAngle(after.yaw - before.yaw) / n;
    if (shift.sigma && sigmas[i])
      *shift.sigma += *sigmas[i] / n;
    else
      shift.sigma.reset();
    if (i > line.first)
      shift.length_m +=
          (before.Translation() - dead_reckoned.T_map_level[i - 1].Translation()).norm();
  }
  return shift;
}

}  // namespace

std::vector<SurveyLine> LinesOf(const Survey& survey) {
  std::vector<SurveyLine> lines;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    if (!HasSoundings(survey.submaps[i].trigger)) continue;
    const bool goes_on = i > 0 && GoesOn(survey.submaps[i - 1].trigger) &&
                         survey.submaps[i - 1].chain == survey.submaps[i].chain;
    if (goes_on)
      lines.back().last = i;
    else
      lines.push_back({i, i});
  }
  return lines;
}

std::string CsvText(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string LinesCsv(const Survey& survey,
                     const SurveyPoses& dead_reckoned,
                     const SurveyPoses& delivered,
                     const std::vector<std::optional<Eigen::Vector3d>>& sigmas,
                     MapAxes axes) {
  std::string out =
      "line,input,start,end,submaps,frames_length_m,heading_deg,north_m,east_m,along_m,"
      "starboard_m,turned_deg,sigma_north_m,sigma_east_m,sigma_turn_deg,length_m\n";
  char text[320];
  int number = 0;
  for (const SurveyLine& line : LinesOf(survey)) {
    ++number;
    const SurveySubmap& first = survey.submaps[line.first];
    const SurveySubmap& last = survey.submaps[line.last];
    const std::optional<Travelled> travelled =
        TravelledIn(survey, {first.start, last.end}, first.chain);
    if (travelled && travelled->straight_m < 0.5 * travelled->all_m) continue;
    const std::string length_m = travelled ? Metres(travelled->straight_m) : std::string();
    const Shift shift = ShiftOf(line, dead_reckoned, delivered, sigmas);
    const Eigen::Vector2d north_east = ToNorthEast(shift.moved, axes);
    const Eigen::Vector2d of_line = shift.frame.Rotation().transpose() * shift.moved;
    // With z up, axes and angles turn the other way.
    const bool ned = axes == MapAxes::kNorthEastDown;
    const double heading_rad = ned ? shift.frame.yaw : kPi / 2.0 - shift.frame.yaw;
    out += std::to_string(number) + ',' + CsvText(survey.InputAt(first.frame_time));
    std::snprintf(text,
                  sizeof text,
                  ",%s,%s,%zu,%.1f,%.1f,%.3f,%.3f,%.3f,%.3f,%.4f,",
                  IsoTime(first.start).c_str(),
                  IsoTime(last.end).c_str(),
                  line.last - line.first + 1,
                  shift.length_m,
                  std::fmod(Rad2Deg(heading_rad) + 720.0, 360.0),
                  north_east.x(),
                  north_east.y(),
                  of_line.x(),
                  ned ? of_line.y() : -of_line.y(),
                  Rad2Deg(ned ? shift.turned_rad : -shift.turned_rad));
    out += text;
    if (!shift.sigma) {
      out += ",,," + length_m + '\n';
      continue;
    }
    const Eigen::Vector2d sigma = ToNorthEast(shift.sigma->head<2>(), axes);
    std::snprintf(
        text, sizeof text, "%.3f,%.3f,%.4f,", sigma.x(), sigma.y(), Rad2Deg(shift.sigma->z()));
    out += text + length_m + '\n';
  }
  return out;
}

}  // namespace seastitch
