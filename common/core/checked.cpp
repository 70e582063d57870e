#include "common/core/checked.hpp"

#include <algorithm>
#include <utility>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {
namespace {

constexpr float kMaxSounding_m = 15'000.0f;  // limit of a sounding's coordinates
constexpr double kMaxSubmap_m = 1e4;         // limit of the distance of points from their frame

bool IsOnEarth(double latitude_rad, double longitude_rad) {
  return std::abs(latitude_rad) <= kPi / 2.0 && std::abs(longitude_rad) <= kPi;
}

bool IsAngle(double rad) { return std::abs(rad) <= kPi; }

bool IsStrictlyRising(const std::vector<double>& values) {
  return std::adjacent_find(values.begin(), values.end(), [](double a, double b) {
           return !(a < b);
         }) == values.end();
}

// At most `most` of the elements, evenly spaced, first and last included.
template <class T>
std::vector<T> EvenlyChosen(const std::vector<T>& elements, int most) {
  const auto n = static_cast<std::size_t>(most);
  if (elements.size() <= n) return elements;
  std::vector<T> chosen;
  chosen.reserve(n);
  for (std::size_t i = 0; i < n; ++i)
    chosen.push_back(elements[i * (elements.size() - 1) / (n - 1)]);
  return chosen;
}

std::optional<Attitude> Checked(const Attitude& attitude) {
  const std::optional<Eigen::Quaterniond> q = UnitQuaternion(attitude.q_ned_imu);
  if (!q || !AreSigmas(attitude.sigma_rpy_rad)) return std::nullopt;
  return Attitude{*q, attitude.sigma_rpy_rad};
}

bool IsChecked(const DvlBeam& beam) {
  return IsSigma(beam.range_m) && std::isfinite(beam.velocity_mps) &&
         IsSigma(beam.quality.value_or(0.0)) && beam.quality.value_or(0.0) <= 1.0;
}

bool IsChecked(const std::optional<InsVertical>& vertical) {
  return !vertical ||
         (std::abs(vertical->value_m) <= kMaxCoordinate_m && IsSigma(vertical->sigma_m));
}

bool IsChecked(const Eigen::Isometry3d& pose) {
  return pose.matrix().allFinite() && pose.translation().cwiseAbs().maxCoeff() <= kMaxCoordinate_m;
}

std::optional<SolvedVertex> Checked(SolvedVertex vertex) {
  const auto covariance = Symmetric(vertex.covariance);
  if (vertex.id.value < 0 || !IsPose2(vertex.T_map_level) || !covariance ||
      !vertex.covariance_with_newest.allFinite())
    return std::nullopt;
  vertex.covariance = *covariance;
  return vertex;
}

std::optional<SolvedEdge> Checked(const SolvedEdge& edge) {
  if (edge.from.value < 0 || edge.to.value < 0 || !(edge.weight >= 0.0 && edge.weight <= 1.0))
    return std::nullopt;
  return edge;
}

std::optional<PairCovariance> Checked(PairCovariance pair) {
  const auto covariance = Symmetric(pair.covariance);
  if (pair.a.value < 0 || pair.b.value < 0 || !covariance) return std::nullopt;
  pair.covariance = *covariance;
  return pair;
}

// Checks each element in place. False: one is refused.
template <class T>
bool CheckAll(std::vector<T>* list) {
  for (T& element : *list) {
    std::optional<T> checked = Checked(std::move(element));
    if (!checked) return false;
    element = *std::move(checked);
  }
  return true;
}

bool HasRisingIds(const std::vector<SolvedVertex>& vertices) {
  return std::adjacent_find(
             vertices.begin(), vertices.end(), [](const SolvedVertex& a, const SolvedVertex& b) {
               return a.id >= b.id;
             }) == vertices.end();
}

bool IsChecked(const PointCloud& cloud) {
  return cloud.points.size() == cloud.soundings.size() &&
         cloud.size() <= static_cast<std::size_t>(kMaxSubmapPoints) &&
         std::all_of(cloud.points.begin(),
                     cloud.points.end(),
                     [](const Eigen::Vector3f& p) { return p.allFinite(); }) &&
         std::all_of(cloud.soundings.begin(), cloud.soundings.end(), [](float n) {
           return n >= 0.0f && std::isfinite(n);
         });
}

// A rotation as a quaternion of a message gives it back. A matrix that is none stays.
Eigen::Isometry3d Quantised(const Eigen::Isometry3d& pose) {
  const auto q = UnitQuaternion(Eigen::Quaterniond(pose.linear()));
  return q ? MakePose(pose.translation(), q->toRotationMatrix()) : pose;
}

}  // namespace

std::optional<Eigen::Quaterniond> UnitQuaternion(const Eigen::Quaterniond& q) {
  constexpr double kTolerance = 1e-3;
  if (!(std::abs(q.norm() - 1.0) <= kTolerance)) return std::nullopt;
  return q.normalized();
}

// --- samples -------------------------------------------------------------------------------------

std::optional<ImuSample> Checked(ImuSample sample) {
  if (!IsTime(sample.time) || !sample.angular_rate_radps.allFinite() ||
      !sample.specific_force_mps2.allFinite() || sample.alignment > HeadingAlignment::kAligned)
    return std::nullopt;
  if (sample.attitude && !(sample.attitude = Checked(*sample.attitude))) return std::nullopt;
  return sample;
}

std::optional<DvlSample> Checked(DvlSample sample) {
  if (!IsTime(sample.time) || !sample.v_dvl_mps.allFinite() || !AreSigmas(sample.sigma_v_mps) ||
      !IsSigma(sample.altitude_m.value_or(0.0)) ||
      !std::isfinite(sample.error_velocity_mps.value_or(0.0)) ||
      !std::all_of(sample.beams.begin(), sample.beams.end(), [](const DvlBeam& beam) {
        return IsChecked(beam);
      }))
    return std::nullopt;
  if (!sample.bottom_lock) sample.v_dvl_mps = sample.sigma_v_mps = Eigen::Vector3d::Zero();
  if (!HasQuality(sample))
    for (DvlBeam& beam : sample.beams) beam.quality.reset();
  return sample;
}

std::optional<DepthSample> Checked(DepthSample sample) {
  if (!IsTime(sample.time) || !std::isfinite(sample.pressure_pa.value_or(0.0)) ||
      !std::isfinite(sample.depth_m) || !IsSigma(sample.sigma_m))
    return std::nullopt;
  return sample;
}

std::optional<NavigationSample> Checked(NavigationSample sample) {
  const auto& position = sample.position;
  if (!IsTime(sample.time) || sample.status > InsStatus::kInvalid ||
      (position && (!IsOnEarth(position->latitude_rad, position->longitude_rad) ||
                    !AreSigmas(position->sigma_north_east_m))) ||
      !IsChecked(sample.depth) || !IsChecked(sample.height) ||
      (sample.velocity &&
       (!sample.velocity->v_ned_mps.allFinite() || !AreSigmas(sample.velocity->sigma_ned_mps))))
    return std::nullopt;
  if (sample.attitude && !(sample.attitude = Checked(*sample.attitude))) return std::nullopt;
  sample.source.resize(std::min(sample.source.size(), kMaxSourceLength));
  return sample;
}

std::optional<PositionFix> Checked(PositionFix fix) {
  Eigen::Matrix2d& covariance = fix.covariance_north_east_m2;
  covariance(1, 0) = covariance(0, 1);
  // Positive definite: a fix with a zero variance would fix the whole map exactly at its position.
  const bool honest = covariance.allFinite() && covariance(0, 0) > 0.0 && covariance(1, 1) > 0.0 &&
                      covariance.determinant() > 0.0;
  if (!IsTime(fix.time) || !IsOnEarth(fix.latitude_rad, fix.longitude_rad) || !honest)
    return std::nullopt;
  fix.source.resize(std::min(fix.source.size(), kMaxSourceLength));
  return fix;
}

MbesPing Thinned(MbesPing ping) {
  ping.beams = EvenlyChosen(ping.beams, kMaxBeams);
  return ping;
}

std::optional<MbesPing> Checked(MbesPing ping) {
  if (!IsTime(ping.time) || !IsSigma(ping.sound_speed_mps)) return std::nullopt;
  if (ping.beams.size() > kMaxBeams) ping = Thinned(std::move(ping));
  if (!std::all_of(ping.beams.begin(), ping.beams.end(), IsPlausible)) return std::nullopt;
  ping.head = std::min(ping.head, kMaxHead);
  return ping;
}

std::vector<SoundingPing> Split(SoundingPing ping) {
  constexpr auto kMost = static_cast<std::size_t>(kMaxSoundings);
  std::vector<SoundingPing> parts;
  if (ping.soundings.size() <= kMost) {
    parts.push_back(std::move(ping));
    return parts;
  }
  for (std::size_t begin = 0; begin < ping.soundings.size(); begin += kMost) {
    const auto first = ping.soundings.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto size = std::min(kMost, ping.soundings.size() - begin);
    parts.push_back({ping.time,
                     ping.ping_number,
                     ping.head,
                     {first, first + static_cast<std::ptrdiff_t>(size)}});
  }
  return parts;
}

std::optional<SoundingPing> Checked(SoundingPing ping) {
  if (!IsTime(ping.time) || ping.soundings.size() > kMaxSoundings) return std::nullopt;
  for (const LevelSounding& sounding : ping.soundings)
    if (!sounding.p_level_m.allFinite() ||
        !(sounding.p_level_m.cwiseAbs().maxCoeff() <= kMaxSounding_m) ||
        !IsSigma(double{sounding.sigma_z_m}))
      return std::nullopt;
  ping.head = std::min(ping.head, kMaxHead);
  return ping;
}

SoundVelocityProfile Thinned(SoundVelocityProfile profile) {
  const std::size_t samples = std::min(profile.depth_m.size(), profile.speed_mps.size());
  profile.depth_m.resize(samples);
  profile.speed_mps.resize(samples);
  profile.depth_m = EvenlyChosen(profile.depth_m, kMaxProfileSamples);
  profile.speed_mps = EvenlyChosen(profile.speed_mps, kMaxProfileSamples);
  return profile;
}

std::optional<SoundVelocityProfile> Checked(SoundVelocityProfile profile) {
  profile = Thinned(std::move(profile));
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!IsTime(profile.time) || profile.depth_m.empty() ||
      !std::all_of(profile.depth_m.begin(), profile.depth_m.end(), is_finite) ||
      !IsStrictlyRising(profile.depth_m) ||
      !std::all_of(profile.speed_mps.begin(), profile.speed_mps.end(), IsSoundSpeed))
    return std::nullopt;
  return profile;
}

// --- results -------------------------------------------------------------------------------------

std::optional<NavState> Checked(NavState nav) {
  const auto covariance = Symmetric(nav.covariance);
  if (!IsTime(nav.time) || !IsChecked(nav.T_map_vehicle) || !covariance ||
      !nav.v_map_mps.allFinite())
    return std::nullopt;
  nav.covariance = *covariance;
  return nav;
}

std::optional<CorrectedNavState> Checked(CorrectedNavState corrected) {
  std::optional<NavState> state = Checked(corrected.state);
  if (!state || !IsPose2(corrected.T_map_nav) || corrected.graph_version < 0 ||
      corrected.jumps < 0 || !IsSigma(corrected.last_jump_m) ||
      !std::isfinite(corrected.last_jump_yaw_rad))
    return std::nullopt;
  corrected.state = *std::move(state);
  return corrected;
}

Footprint Thinned(const Footprint& footprint) {
  const std::size_t step = (footprint.size() + kMaxFootprintCorners - 1) / kMaxFootprintCorners;
  if (step <= 1) return footprint;
  Footprint thinned;
  for (std::size_t i = 0; i < footprint.size(); i += step) thinned.push_back(footprint[i]);
  return thinned;
}

std::optional<Submap> Checked(Submap submap) {
  const bool in_order = IsTime(submap.start) && IsTime(submap.end) &&
                        submap.start <= submap.frame_time && submap.frame_time <= submap.end;
  if (submap.id.value < 0 || !in_order || submap.trigger > SubmapTrigger::kFixes ||
      !IsChecked(submap.T_map_submap) || !IsSigma(submap.heading_sigma_rad.value_or(0.0)) ||
      !IsAngle(submap.dvl_yaw_rad) || !IsChecked(submap.cloud))
    return std::nullopt;
  for (std::optional<Eigen::Matrix3d>* const matrix :
       {&submap.covariance_from_previous, &submap.predicted_information})
    if (*matrix && !(*matrix = Symmetric(**matrix))) return std::nullopt;
  if (!std::all_of(submap.footprint.begin(), submap.footprint.end(), [](const Eigen::Vector2d& p) {
        return p.allFinite();
      }))
    return std::nullopt;
  submap.footprint = Thinned(submap.footprint);
  return submap;
}

std::optional<GraphVertex> Checked(GraphVertex vertex) {
  if (!IsTime(vertex.time) || vertex.id.value < 0 || vertex.chain < 0 ||
      !IsPose2(vertex.dead_reckoned) || !IsSigma(vertex.heading_sigma_rad.value_or(0.0)))
    return std::nullopt;
  return vertex;
}

std::optional<GraphEdge> Checked(GraphEdge edge) {
  const bool right_ends = edge.from == edge.to ? edge.kind != EdgeKind::kLoopClosure
                                               : edge.kind != EdgeKind::kPositionFix;
  const auto information = Symmetric(edge.information);
  if (edge.kind > EdgeKind::kPositionFix || edge.verdict > LoopVerdict::kNotConverged ||
      edge.from.value < 0 || edge.to.value < 0 || !right_ends || !information ||
      !IsPose2(edge.T_from_to) || !std::isfinite(edge.z_offset_m) || !IsSigma(edge.rms_m) ||
      !IsSigma(edge.overlap_m2) || !IsAngle(edge.dvl_yaw_rad) ||
      !(Hypotenuse(edge.overlap_center_m.x(), edge.overlap_center_m.y()) <= kMaxSubmap_m))
    return std::nullopt;
  edge.information = *information;
  return edge;
}

std::optional<GraphUpdate> Checked(GraphUpdate update) {
  if (update.version < 1 || update.vertices.size() > kMaxVerticesPerUpdate ||
      update.edges.size() > kMaxEdgesPerUpdate || !update.mounting.AreUsable() ||
      !CheckAll(&update.vertices) || !CheckAll(&update.edges))
    return std::nullopt;
  return update;
}

std::optional<GraphUpdate> WithoutMalformedEdges(GraphUpdate update) {
  std::vector<GraphEdge> edges;
  for (const GraphEdge& edge : std::exchange(update.edges, {}))
    if (const std::optional<GraphEdge> checked = Checked(edge)) edges.push_back(*checked);
  std::optional<GraphUpdate> rest = Checked(std::move(update));
  if (rest) rest->edges = std::move(edges);
  return rest;
}

std::optional<PoseGraph> Checked(PoseGraph graph) {
  if (graph.graph_version < 0 || !CheckAll(&graph.vertices) || !CheckAll(&graph.loop_edges) ||
      !HasRisingIds(graph.vertices))
    return std::nullopt;
  for (auto& [chain, errors] : graph.mounting) {
    const auto covariance = Symmetric(errors.covariance);
    if (chain < 0 || !covariance ||
        !IsPose2({errors.sonar_m.x(), errors.sonar_m.y(), errors.dvl_yaw_rad}))
      return std::nullopt;
    errors.covariance = *covariance;
  }
  return graph;
}

std::optional<CovarianceRequest> Checked(CovarianceRequest request) {
  if (request.graph_version < 1) return std::nullopt;
  request.pairs.resize(std::min(request.pairs.size(), std::size_t{kMaxCovariancePairs}));
  request.sender.resize(std::min(request.sender.size(), kMaxProcessName));
  return request;
}

std::optional<PairCovariances> Checked(PairCovariances answer) {
  if (answer.pairs.size() > kMaxCovariancePairs)
    answer.pairs.erase(answer.pairs.begin() + kMaxCovariancePairs, answer.pairs.end());
  if (answer.graph_version < 1 || !CheckAll(&answer.pairs)) return std::nullopt;
  answer.recipient.resize(std::min(answer.recipient.size(), kMaxProcessName));
  return answer;
}

// --- poses ---------------------------------------------------------------------------------------

NavState Quantised(NavState nav) {
  nav.T_map_vehicle = Quantised(nav.T_map_vehicle);
  return nav;
}

CorrectedNavState Quantised(CorrectedNavState corrected) {
  corrected.state = Quantised(std::move(corrected.state));
  return corrected;
}

Submap Quantised(Submap submap) {
  submap.T_map_submap = Quantised(submap.T_map_submap);
  return submap;
}

}  // namespace seastitch
