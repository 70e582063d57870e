#include "products/truth.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace seastitch {
namespace {

constexpr const char* kHeader = "utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg";
constexpr double kLongestGapS = 1.0;

template <class T>
bool ParseField(std::string_view field, T* value) {
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), *value);
  return error == std::errc() && end == field.data() + field.size();
}

std::optional<TruthState> ParseLine(std::string_view line) {
  std::array<std::string_view, 7> fields;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::size_t comma = line.find(',');
    const bool last = i + 1 == fields.size();
    if ((comma == std::string_view::npos) != last) return std::nullopt;
    fields[i] = line.substr(0, comma);
    if (!last) line.remove_prefix(comma + 1);
  }
  std::int64_t utime = 0;
  if (!ParseField(fields[0], &utime)) return std::nullopt;
  std::array<double, 6> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!ParseField(fields[i + 1], &v[i]) || !std::isfinite(v[i])) return std::nullopt;
  }
  return TruthState{FromUtime(utime), {v[0], v[1], WrapAngle(Deg2Rad(v[5]))}};
}

// The pose at that time, linear between the two states around it.
template <class States, class PoseOf>
std::optional<Pose2> PoseAt(const States& states, Time time, PoseOf pose_of) {
  const auto after = std::lower_bound(
      states.begin(), states.end(), time, [](const auto& s, Time t) { return s.time < t; });
  if (after == states.end()) return std::nullopt;
  if (after->time == time) return pose_of(*after);
  if (after == states.begin()) return std::nullopt;
  const auto before = after - 1;
  const double gap_s = ToSeconds(after->time - before->time);
  if (gap_s > kLongestGapS) return std::nullopt;
  const double u = ToSeconds(time - before->time) / gap_s;
  const Pose2 a = pose_of(*before);
  const Pose2 b = pose_of(*after);
  return Pose2{a.x + u * (b.x - a.x),
               a.y + u * (b.y - a.y),
               WrapAngle(a.yaw + u * WrapAngle(b.yaw - a.yaw))};
}

Pose2 DeadReckoned(const CorrectedState& s) {
  return {s.p_dead_reckoned.x(), s.p_dead_reckoned.y(), s.rpy_dead_reckoned_rad.z()};
}
Pose2 Corrected(const CorrectedState& s) { return s.corrected; }
Pose2 True(const TruthState& s) { return s.T_map_level; }

template <class PoseOf>
TrackError ErrorOf(const std::vector<CorrectedState>& track,
                   const std::vector<TruthState>& truth,
                   const Pose2& T_map_truthmap,
                   PoseOf pose_of) {
  TrackError error;
  double position2 = 0.0, yaw2 = 0.0;
  for (const CorrectedState& s : track) {
    const std::optional<Pose2> there = PoseAt(truth, s.time, True);
    if (!there) continue;
    const Pose2 expected = T_map_truthmap * *there;
    const Pose2 got = pose_of(s);
    const double off_m = (got.Translation() - expected.Translation()).norm();
    position2 += off_m * off_m;
    error.position_max_m = std::max(error.position_max_m, off_m);
    error.position_end_m = off_m;
    yaw2 += std::pow(WrapAngle(got.yaw - expected.yaw), 2);
    ++error.states;
  }
  if (error.states > 0) {
    const double n = static_cast<double>(error.states);
    error.position_rms_m = std::sqrt(position2 / n);
    error.yaw_rms_deg = Rad2Deg(std::sqrt(yaw2 / n));
  }
  return error;
}

}  // namespace

std::vector<TruthState> ReadTruth(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be opened");
  std::vector<TruthState> truth;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto fail = [&](const std::string& reason) {
      throw std::runtime_error(path.string() + ":" + std::to_string(number) + ": " + reason);
    };
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1) {
      if (line != kHeader) fail(std::string("expected the header line ") + kHeader);
      continue;
    }
    const std::optional<TruthState> state = ParseLine(line);
    if (!state) fail("expected a time in microseconds and six finite numbers");
    if (!truth.empty() && state->time <= truth.back().time) fail("time does not rise");
    truth.push_back(*state);
  }
  if (truth.empty()) throw std::runtime_error(path.string() + ": holds no state");
  return truth;
}

std::optional<TruthComparison> CompareWithTruth(const std::vector<CorrectedState>& track,
                                                const std::vector<TruthState>& truth,
                                                Time align_time) {
  const std::optional<Pose2> true_pose = PoseAt(truth, align_time, True);
  const std::optional<Pose2> dead_reckoned = PoseAt(track, align_time, DeadReckoned);
  const std::optional<Pose2> corrected = PoseAt(track, align_time, Corrected);
  if (!true_pose || !dead_reckoned || !corrected) return std::nullopt;
  const Pose2 from_truth = Inverse(*true_pose);
  const Pose2 none;
  return TruthComparison{ErrorOf(track, truth, *dead_reckoned * from_truth, DeadReckoned),
                         ErrorOf(track, truth, *corrected * from_truth, Corrected),
                         ErrorOf(track, truth, none, DeadReckoned),
                         ErrorOf(track, truth, none, Corrected)};
}

}  // namespace seastitch
