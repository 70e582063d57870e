#include "products/track/track.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "common/geo/map_frame.hpp"

namespace seastitch {
namespace {

double SmoothStep(double u) { return u * u * (3.0 - 2.0 * u); }

void AppendNumber(std::string* out, int decimals, double value) {
  std::array<char, 400> text;  // of any double
  const auto end = std::to_chars(
      text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  *out += ',';
  out->append(text.data(), end.ptr);
}

// Position between two poses, cubic with the velocities at both; w: 0 at the first, 1 at the
// second.
Eigen::Vector2d Cubic(const SmoothedPose& a, const SmoothedPose& b, double w) {
  const double dt_s = ToSeconds(b.time - a.time);
  const double step = SmoothStep(w);
  return (1.0 - step) * a.smoothed.Translation() + step * b.smoothed.Translation() +
         dt_s * w * (1.0 - w) * ((1.0 - w) * a.v_map_mps - w * b.v_map_mps);
}

// The smoothed pose of a submap's frame, from the states of the track around it.
Pose2 SmoothedFrame(const Survey& survey, const SurveySubmap& submap) {
  const Pose2 frame = LevelPose(submap.T_map_submap);
  const auto after = std::lower_bound(
      survey.track.begin(),
      survey.track.end(),
      std::pair(submap.chain, submap.frame_time),
      [](const TrackState& s, const auto& place) { return std::pair(s.chain, s.time) < place; });
  const bool has_after = after != survey.track.end() && after->chain == submap.chain;
  const bool has_before = after != survey.track.begin() && std::prev(after)->chain == submap.chain;
  if (!has_after && !has_before) return frame;
  const TrackState& next = has_after ? *after : *std::prev(after);
  const TrackState& last = has_before ? *std::prev(after) : next;
  if (!next.smoothed || !last.smoothed) return frame;
  if (!has_after || !has_before) return *next.smoothed * Inverse(next.Level()) * frame;
  const double w = ToSeconds(submap.frame_time - last.time) / ToSeconds(next.time - last.time);
  return PoseBetween(*last.smoothed, *next.smoothed, w);
}

}  // namespace

void Smooth(const std::vector<SmoothedPose>& poses,
            std::int32_t chain,
            std::vector<TrackState>* track) {
  if (poses.empty()) return;
  auto after = poses.begin();
  for (TrackState& state : *track) {
    if (state.chain != chain) continue;
    while (after != poses.end() && after->time <= state.time) ++after;
    const SmoothedPose& next = after == poses.end() ? poses.back() : *after;
    const SmoothedPose& last = after == poses.begin() ? next : *std::prev(after);
    if (after == poses.begin() || after == poses.end()) {
      state.smoothed = next.smoothed * Inverse(next.given) * state.Level();
      continue;
    }
    const double w = ToSeconds(state.time - last.time) / ToSeconds(next.time - last.time);
    const Eigen::Vector2d p = Cubic(last, next, w);
    const auto turned = [](const SmoothedPose& pose) {
      return WrapAngle(pose.smoothed.yaw - pose.given.yaw);
    };
    const double turned_rad = turned(last) + w * WrapAngle(turned(next) - turned(last));
    state.smoothed = {p.x(), p.y(), WrapAngle(state.rpy_rad.z() + turned_rad)};
  }
}

TrackCorrection::TrackCorrection(const Survey& survey,
                                 const SurveyPoses& poses,
                                 const std::vector<std::optional<Eigen::Vector3d>>& sigmas) {
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    const SurveySubmap& s = survey.submaps[i];
    frames_.push_back({s.chain,
                       s.frame_time,
                       SmoothedFrame(survey, s),
                       poses.VehicleAt(i),
                       sigmas[i],
                       poses.MountingOf(i)});
  }
  const auto place = [](const Frame& f) { return std::pair(f.chain, f.time); };
  const auto earlier = [&](const Frame& a, const Frame& b) { return place(a) < place(b); };
  const auto same = [&](const Frame& a, const Frame& b) { return place(a) == place(b); };
  std::stable_sort(frames_.begin(), frames_.end(), earlier);
  frames_.erase(std::unique(frames_.begin(), frames_.end(), same), frames_.end());
}

TrackCorrection::Between TrackCorrection::Find(Time time, std::int32_t chain) const {
  const auto [begin, end] =
      std::equal_range(frames_.begin(),
                       frames_.end(),
                       Frame{chain, {}, {}, {}, {}, {}},
                       [](const auto& a, const auto& b) { return a.chain < b.chain; });
  if (begin == end) return {nullptr, nullptr, 0.0};
  const auto after =
      std::upper_bound(begin, end, time, [](Time t, const Frame& f) { return t < f.time; });
  if (after == begin) return {&*begin, &*begin, 0.0};
  const auto before = after - 1;
  if (after == end) return {&*before, &*before, 0.0};
  const double u = ToSeconds(time - before->time) / ToSeconds(after->time - before->time);
  return {&*before, &*after, SmoothStep(u)};
}

Pose2 TrackCorrection::operator()(Time time, const Pose2& T_map_level, std::int32_t chain) const {
  const Between at = Find(time, chain);
  if (at.before == nullptr) return T_map_level;
  const auto moved_with = [&](const Frame& f) {
    return f.corrected * TravelledPose(Inverse(f.smoothed) * T_map_level, f.mounting);
  };
  const Pose2 a = moved_with(*at.before);
  if (at.before == at.after) return a;
  return PoseBetween(a, moved_with(*at.after), at.weight_after);
}

std::optional<Eigen::Vector3d> TrackCorrection::Sigma(Time time, std::int32_t chain) const {
  const Between at = Find(time, chain);
  if (at.before == nullptr || !at.before->sigma || !at.after->sigma) return std::nullopt;
  return (1.0 - at.weight_after) * *at.before->sigma + at.weight_after * *at.after->sigma;
}

std::vector<CorrectedState> CorrectTrack(const Survey& survey, const TrackCorrection& correction) {
  std::vector<TrackState> states = survey.track;
  if (states.empty()) {
    for (const SurveySubmap& s : survey.submaps) {
      states.push_back({s.frame_time,
                        s.T_map_submap.translation(),
                        RpyFromRotation(s.T_map_submap.linear()),
                        Eigen::Vector3d::Zero(),
                        s.chain});
    }
  }
  std::vector<CorrectedState> track;
  track.reserve(states.size());
  for (const TrackState& s : states) {
    std::optional<Eigen::Vector3d> sigma = correction.Sigma(s.time, s.chain);
    if (survey.submaps.empty()) sigma = s.sigma;
    track.push_back(
        {s.time, s.p_map, s.rpy_rad, correction(s.time, s.Smoothed(), s.chain), sigma, s.chain});
  }
  return track;
}

std::vector<std::vector<CorrectedState>> TracksOfDives(const std::vector<CorrectedState>& track) {
  std::vector<std::vector<CorrectedState>> dives;
  for (const CorrectedState& state : track) {
    if (dives.empty() || dives.back().front().chain != state.chain) dives.emplace_back();
    dives.back().push_back(state);
  }
  std::stable_sort(dives.begin(), dives.end(), [](const auto& a, const auto& b) {
    return a.front().time < b.front().time;
  });
  return dives;
}

double TrackLength(const std::vector<CorrectedState>& track) {
  double length = 0.0;
  for (std::size_t i = 1; i < track.size(); ++i) {
    if (track[i].chain != track[i - 1].chain) continue;
    length += (track[i].p_dead_reckoned - track[i - 1].p_dead_reckoned).head<2>().norm();
  }
  return length;
}

double TrackDuration(const std::vector<CorrectedState>& track) {
  double duration_s = 0.0;
  for (std::size_t i = 1; i < track.size(); ++i)
    if (track[i].chain == track[i - 1].chain)
      duration_s += ToSeconds(track[i].time - track[i - 1].time);
  return duration_s;
}

std::string TrackCsv(const std::vector<CorrectedState>& track, const std::optional<Datum>& datum) {
  std::string out =
      "utime_us,dr_x_m,dr_y_m,dr_z_m,dr_roll_deg,dr_pitch_deg,dr_yaw_deg,x_m,y_m,z_m,yaw_deg,"
      "sigma_x_m,sigma_y_m,sigma_yaw_deg";
  if (datum) out += ",latitude_deg,longitude_deg";
  out += '\n';
  const MapFrame map(datum.value_or(Datum{}));
  for (const CorrectedState& s : track) {
    out += std::to_string(ToUtime(s.time));
    for (const double v : s.p_dead_reckoned) AppendNumber(&out, 4, v);
    for (const double v : s.rpy_dead_reckoned_rad) AppendNumber(&out, 5, Rad2Deg(v));
    AppendNumber(&out, 4, s.corrected.x);
    AppendNumber(&out, 4, s.corrected.y);
    AppendNumber(&out, 4, s.p_dead_reckoned.z());
    AppendNumber(&out, 5, Rad2Deg(s.corrected.yaw));
    if (s.sigma) {
      AppendNumber(&out, 4, s.sigma->x());
      AppendNumber(&out, 4, s.sigma->y());
      AppendNumber(&out, 5, Rad2Deg(s.sigma->z()));
    } else {
      out += ",,,";
    }
    if (datum) {
      const Datum point = map.PointAt({s.corrected.x, s.corrected.y}, s.p_dead_reckoned.z());
      AppendNumber(&out, 9, point.latitude_deg);
      AppendNumber(&out, 9, point.longitude_deg);
    }
    out += '\n';
  }
  return out;
}

}  // namespace seastitch
