#include "survey/line/line_placer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kBatch = 1024;
// Of the search for the nearest place. A line does not come back to itself within so many
// positions.
constexpr std::ptrdiff_t kStride = 32;
// Half a swath is at most so many times the depth below the sonar; and a margin.
constexpr double kSwathRatio = 10.0;
constexpr double kSwathM = 50.0;
constexpr double kMaxSwathM = 10'000.0;

}  // namespace

double SwathReach(double below_m) {
  return std::min(kSwathM + kSwathRatio * std::abs(below_m), kMaxSwathM);
}

void LinePlacer::Add(const LinePoint& point, std::vector<SurveyRecord>* out) {
  batch_.push_back(point);
  if (batch_.size() >= kBatch) PlaceBatch(out);
}

void LinePlacer::Finish(std::vector<SurveyRecord>* out) {
  PlaceBatch(out);
  while (!pings_.empty()) GiveFirst(out);
}

void LinePlacer::PlaceBatch(std::vector<SurveyRecord>* out) {
  const std::vector<LinePoint> batch = std::exchange(batch_, {});
  if (!params_.track || !params_.to_geographic) {
    counters_["line_points_without_track"] += static_cast<std::int64_t>(batch.size());
    return;
  }
  std::vector<Eigen::Vector2d> places;
  for (const LinePoint& point : batch) places.push_back(point.p.head<2>());
  params_.to_geographic->Convert(&places);
  for (std::size_t i = 0; i < batch.size(); ++i)
    if (places[i].allFinite())
      Place(batch[i], params_.track->ToMap({places[i].x(), places[i].y()}), out);
    else
      ++counters_["line_points_outside_crs"];
}

std::optional<Time> LinePlacer::TimeOf(const LinePoint& point, const Eigen::Vector2d& p_map) const {
  if (params_.time_zero)
    return point.time_s ? std::optional(*params_.time_zero + FromSeconds(*point.time_s))
                        : std::nullopt;
  const auto part = params_.parts.find(point.line);
  if (part == params_.parts.end()) return std::nullopt;
  const std::optional<Time> t = params_.track->TimeNearest(p_map, part->second, kStride);
  if (!t) return std::nullopt;
  // The same ping for points that lie abreast of each other.
  const Duration step = FromSeconds(kNearestPingS);
  return std::max(Time(t->time_since_epoch() / step * step), part->second.begin);
}

// The ping at that time or shortly before it, else a new one. end(): the track does not have it.
std::map<Time, LinePlacer::Ping>::iterator LinePlacer::PingAt(Time t) {
  const auto after = pings_.upper_bound(t);
  if (after != pings_.begin() && ToSeconds(t - std::prev(after)->first) < kPingS)
    return std::prev(after);
  const std::optional<LineTrack::State> vehicle = params_.track->At(t);
  return vehicle ? pings_.try_emplace(after, t, Ping{*vehicle, {}}) : pings_.end();
}

void LinePlacer::Place(const LinePoint& point,
                       const Eigen::Vector2d& p_map,
                       std::vector<SurveyRecord>* out) {
  const std::optional<Time> t = TimeOf(point, p_map);
  if (t && given_ && *t <= *given_) {
    ++counters_["line_points_out_of_order"];
    return;
  }
  const auto ping = t ? PingAt(*t) : pings_.end();
  if (ping == pings_.end()) {
    ++counters_["line_points_without_track"];
    return;
  }
  const LineTrack::State& vehicle = ping->second.vehicle;
  const double below_m = params_.depth_per_z * point.p.z() - vehicle.depth_m;
  const Eigen::Vector2d off = p_map - vehicle.p_north_east_m;
  if (!(off.norm() <= SwathReach(below_m)) || !(std::abs(below_m) < kMaxSwathM)) {
    ++counters_["line_points_far_from_track"];
    if (ping->second.soundings.empty()) pings_.erase(ping);
    return;
  }
  const double c = std::cos(vehicle.heading_rad);
  const double s = std::sin(vehicle.heading_rad);
  PlacedBeam beam;
  beam.p_level_m =
      Eigen::Vector3d(c * off.x() + s * off.y(), c * off.y() - s * off.x(), below_m).cast<float>();
  beam.flags = kBeamValid;
  ping->second.soundings.push_back(beam);
  ++counters_["line_points_used"];
  if (++held_ > kHeldPoints) GiveFirst(out);
}

void LinePlacer::GiveFirst(std::vector<SurveyRecord>* out) {
  auto first = pings_.extract(pings_.begin());
  PlacedPing ping;
  ping.time = first.key();
  ping.ping_number = number_++;
  ping.origin_depth_m = first.mapped().vehicle.depth_m;
  ping.soundings = std::move(first.mapped().soundings);
  held_ -= ping.soundings.size();
  given_ = ping.time;
  out->emplace_back(std::move(ping));
}

}  // namespace seastitch
