#include "products/track/truth.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

#include "common/core/information.hpp"
#include "common/core/mounting.hpp"
#include "common/core/time_series.hpp"

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

// The true pose at that time, linear between the two states around it.
std::optional<Pose2> TruthAt(const std::vector<TruthState>& truth, Time time) {
  const auto around = AroundOf(truth, time, kLongestGapS);
  if (!around) return std::nullopt;
  return PoseBetween(around->before.T_map_level, around->after.T_map_level, around->share);
}

struct Matched {
  Time time;
  Pose2 truth;
  Pose2 dead_reckoned;
  Pose2 corrected;
};

std::vector<Matched> Match(const std::vector<CorrectedState>& track,
                           const std::vector<TruthState>& truth) {
  std::vector<Matched> matched;
  for (const CorrectedState& s : track) {
    if (const std::optional<Pose2> there = TruthAt(truth, s.time)) {
      const Pose2 dead_reckoned{
          s.p_dead_reckoned.x(), s.p_dead_reckoned.y(), s.rpy_dead_reckoned_rad.z()};
      matched.push_back({s.time, *there, dead_reckoned, s.corrected});
    }
  }
  return matched;
}

// The rigid motion that lays the poses best, in least squares of position, on the truth.
Pose2 BestFit(const std::vector<Matched>& matched, Pose2 Matched::*estimate) {
  const double n = static_cast<double>(matched.size());
  Eigen::Vector2d truth_mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Matched& m : matched) {
    truth_mean += m.truth.Translation() / n;
    mean += (m.*estimate).Translation() / n;
  }
  double along = 0.0, across = 0.0;
  for (const Matched& m : matched) {
    const Eigen::Vector2d t = m.truth.Translation() - truth_mean;
    const Eigen::Vector2d e = (m.*estimate).Translation() - mean;
    along += e.dot(t);
    across += e.x() * t.y() - e.y() * t.x();
  }
  const Pose2 turn{0.0, 0.0, std::atan2(across, along)};
  const Eigen::Vector2d shift = truth_mean - turn.Rotation() * mean;
  return {shift.x(), shift.y(), turn.yaw};
}

// The value below which 99.9 % of the changes of the position error within a second lie.
double ChangeWithinASecond(const std::vector<Matched>& matched, Pose2 Matched::*estimate) {
  constexpr double kShare = 0.999;
  const auto error = [estimate](const Matched& m) -> Eigen::Vector2d {
    return (m.*estimate).Translation() - m.truth.Translation();
  };
  std::vector<double> changes;
  auto before = matched.begin();
  for (auto m = matched.begin(); m != matched.end(); ++m) {
    if (m->time < before->time) before = m;  // another dive
    while (ToSeconds(m->time - before->time) > 1.0) ++before;
    changes.push_back((error(*m) - error(*before)).norm());
  }
  const auto at = changes.begin() +
                  static_cast<std::ptrdiff_t>(kShare * static_cast<double>(changes.size() - 1));
  std::nth_element(changes.begin(), at, changes.end());
  return *at;
}

TrackError ErrorOf(const std::vector<Matched>& matched,
                   Pose2 Matched::*estimate,
                   const Pose2& T_truth_map) {
  TrackError error;
  double position2 = 0.0, yaw = 0.0, yaw2 = 0.0;
  for (const Matched& m : matched) {
    const Pose2 got = T_truth_map * (m.*estimate);
    const double off_m = (got.Translation() - m.truth.Translation()).norm();
    position2 += off_m * off_m;
    error.position_max_m = std::max(error.position_max_m, off_m);
    error.position_end_m = off_m;
    const double off_rad = WrapAngle(got.yaw - m.truth.yaw);
    yaw += off_rad;
    yaw2 += off_rad * off_rad;
    ++error.states;
  }
  const double n = static_cast<double>(error.states);
  error.position_rms_m = std::sqrt(position2 / n);
  error.yaw_rms_deg = Rad2Deg(std::sqrt(yaw2 / n));
  error.yaw_mean_deg = Rad2Deg(yaw / n);
  error.position_change_m = ChangeWithinASecond(matched, estimate);
  return error;
}

std::optional<TruthComparison> Compare(const std::vector<Matched>& matched) {
  if (matched.empty()) return std::nullopt;
  const Pose2 as_delivered;
  return TruthComparison{
      ErrorOf(matched, &Matched::dead_reckoned, as_delivered),
      ErrorOf(matched, &Matched::corrected, as_delivered),
      ErrorOf(matched, &Matched::dead_reckoned, BestFit(matched, &Matched::dead_reckoned)),
      ErrorOf(matched, &Matched::corrected, BestFit(matched, &Matched::corrected))};
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
                                                const std::vector<TruthState>& truth) {
  return Compare(Match(track, truth));
}

std::optional<TruthComparison> ComparePublishedWithTruth(
    const std::vector<PublishedState>& published, const std::vector<TruthState>& truth) {
  std::vector<Matched> matched;
  for (const PublishedState& s : published)
    if (const std::optional<Pose2> there = TruthAt(truth, s.time))
      matched.push_back({s.time, *there, s.nav, s.corrected});
  return Compare(matched);
}

std::optional<ClosureErrors> CompareClosuresWithTruth(const Survey& survey,
                                                      const std::vector<TruthState>& truth) {
  struct Frame {
    std::optional<Pose2> truth;
    std::int32_t chain = 0;
  };
  std::map<SubmapId, Frame> frames;
  for (const SurveySubmap& submap : survey.submaps)
    frames[submap.id] = {TruthAt(truth, submap.frame_time), submap.chain};
  ClosureErrors errors;
  for (const LoopRow& row : LoopRows(survey)) {
    if (!(row.weight >= kAcceptedWeight)) continue;
    const GraphEdge& edge = *row.edge;
    const Frame &from = frames[edge.from], &to = frames[edge.to];
    const std::optional<SqrtInformation> root = FactorInformation(edge.information);
    if (!from.truth || !to.truth || !root) continue;
    const MountingErrors of_from = survey.solution.MountingOf(from.chain);
    const MountingErrors of_to = survey.solution.MountingOf(to.chain);
    const Pose2 true_from_to =
        Inverse(SoundingPose(*from.truth, of_from)) * SoundingPose(*to.truth, of_to);
    const EdgeByMounting by = ByMounting(edge, from.chain == to.chain);
    Eigen::Vector3d error = MeasuredBy(survey.NewestDvlYaw(to.chain), edge, by).Vector() +
                            MountingCorrection(by, of_from, of_to) - true_from_to.Vector();
    error.z() = WrapAngle(error.z());
    const double chi2 = (root->W * error).squaredNorm();
    ++errors.closures;
    errors.degrees_of_freedom += static_cast<std::uint64_t>(root->rank);
    errors.chi2 += chi2;
    errors.worst_chi2 = std::max(errors.worst_chi2, chi2);
  }
  if (errors.closures == 0) return std::nullopt;
  return errors;
}

}  // namespace seastitch
