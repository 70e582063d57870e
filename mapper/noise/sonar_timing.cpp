#include "mapper/noise/sonar_timing.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kPingsOfABlock = 64;
constexpr std::size_t kFewestBlocks = 8;
constexpr std::size_t kMostBlocks = 512;
// Half the longest time [s] over which a rate is measured: longer than the resolution of the
// attitude requires, shorter than half a roll period.
constexpr double kMostHalfRateS = 0.05;
constexpr double kLongestGapS = 1.0;
constexpr int kFewestSoundings = 16;
// Residuals beyond this many medians are bounded, for example of a wreck or of fish.
constexpr double kBoundInMedians = 4.0;

// A straight line across the track through soundings: z = at_zero + slope y.
struct Line {
  double at_zero = 0.0;
  double slope = 0.0;
};

struct Weighted {
  double w = 0.0, y = 0.0, z = 0.0, yy = 0.0, yz = 0.0;
  void Add(double weight, double at, double value) {
    w += weight;
    y += weight * at;
    z += weight * value;
    yy += weight * at * at;
    yz += weight * at * value;
  }
  std::optional<Line> Fit() const {
    const double spread = yy - y * y / w;
    if (!(w > 0.0 && spread > 0.0)) return std::nullopt;
    const double slope = (yz - y * z / w) / spread;
    return Line{(z - slope * y) / w, slope};
  }
};

// Fits a line; a second pass bounds points far from the first fit.
std::optional<Line> FitLine(const std::vector<Eigen::Vector2d>& level) {
  Weighted all;
  for (const Eigen::Vector2d& p : level) all.Add(1.0, p.x(), p.y());
  const std::optional<Line> first = all.Fit();
  if (!first) return std::nullopt;
  const auto off = [&](const Eigen::Vector2d& p) {
    return std::abs(p.y() - first->at_zero - first->slope * p.x());
  };
  double sum = 0.0;
  for (const Eigen::Vector2d& p : level) sum += off(p);
  const double bound = 2.0 * sum / static_cast<double>(level.size());
  Weighted bounded;
  for (const Eigen::Vector2d& p : level)
    bounded.Add(off(p) <= bound ? 1.0 : bound / off(p), p.x(), p.y());
  return bounded.Fit();
}

}  // namespace

void BlockRegression::Sums::Add(const Sums& other) {
  xx += other.xx;
  xy += other.xy;
  yy += other.yy;
  rows += other.rows;
}

double BlockRegression::Factor() const {
  const Sums total = Total();
  return total.xx > 0.0 ? total.xy / total.xx : 0.0;
}

BlockRegression::Sums BlockRegression::Total() const {
  Sums total;
  for (const Sums& block : blocks_) total.Add(block);
  return total;
}

void BlockRegression::JoinNeighbours() {
  for (std::size_t i = 0; i + 1 < blocks_.size(); i += 2) {
    blocks_[i].Add(blocks_[i + 1]);
    blocks_[i / 2] = blocks_[i];
  }
  blocks_.resize(blocks_.size() / 2);
}

void BlockRegression::AddBlock(const std::vector<Row>& rows) {
  if (rows.empty()) return;
  const double so_far = blocks_.size() < kFewestBlocks ? 0.0 : Factor();
  const auto off = [&](const Row& row) { return std::abs(row.y - so_far * row.x); };
  std::vector<double> sizes;
  for (const Row& row : rows) sizes.push_back(off(row));
  const double bound = kBoundInMedians * Median(std::move(sizes));
  Sums sums;
  for (const Row& row : rows) {
    const double w = off(row) <= bound ? 1.0 : bound / off(row);
    sums.xx += w * row.x * row.x;
    sums.xy += w * row.y * row.x;
    sums.yy += w * row.y * row.y;
    sums.rows += 1.0;
  }
  if (!(std::isfinite(sums.xx) && std::isfinite(sums.yy))) return;
  blocks_.push_back(sums);
  if (blocks_.size() == kMostBlocks) JoinNeighbours();
}

std::optional<BlockRegression::Result> BlockRegression::Estimate() const {
  const Sums total = Total();
  if (blocks_.size() < kFewestBlocks || !(total.xx > 0.0)) return std::nullopt;
  const double factor = total.xy / total.xx;
  double scores = 0.0;
  for (const Sums& block : blocks_) scores += std::pow(block.xy - block.xx * factor, 2);
  const auto n = static_cast<double>(blocks_.size());
  const double after = total.yy - 2.0 * factor * total.xy + factor * total.xx * factor;
  return Result{factor,
                std::sqrt(n / (n - 1.0) * scores) / total.xx,
                std::sqrt(total.yy / total.rows),
                std::sqrt(std::max(0.0, after) / total.rows)};
}

std::optional<SonarTiming::Look> SonarTiming::LookAt(const GeoreferencedPing& ping) {
  if (static_cast<int>(ping.soundings.size()) < kFewestSoundings) return std::nullopt;
  const Eigen::Vector3d vehicle = ping.T_map_vehicle.translation();
  const double yaw = LevelPose(ping.T_map_vehicle).yaw;
  const Eigen::Vector2d starboard(-std::sin(yaw), std::cos(yaw));
  std::vector<Eigen::Vector2d> level;  // starboard, down from the vehicle
  level.reserve(ping.soundings.size());
  for (const Sounding& sounding : ping.soundings) {
    const Eigen::Vector3d p = sounding.p_map - vehicle;
    level.emplace_back(starboard.dot(p.head<2>()), p.z());
  }
  const std::optional<Line> line = FitLine(level);
  if (!line || !(line->at_zero > 0.0)) return std::nullopt;
  Look look;
  look.time = ping.time;
  look.slope_rad = std::atan(line->slope);
  return look;
}

std::optional<SonarTiming::Roll> SonarTiming::RollBefore(const GeoreferencedPing& ping,
                                                         const PoseLookup& T_map_vehicle_at) {
  const auto [last, is_first] = times_.try_emplace(ping.head, ping.time);
  if (is_first || last->second == ping.time) return std::nullopt;
  const Time time = std::exchange(last->second, ping.time);
  const double half_s = std::min(ToSeconds(ping.time - time), kMostHalfRateS);
  if (!(half_s > 0.0)) return std::nullopt;
  const auto early = T_map_vehicle_at(time - FromSeconds(half_s));
  const auto late = T_map_vehicle_at(time + FromSeconds(half_s));
  if (!early || !late) return std::nullopt;
  const Eigen::Vector3d a = RpyFromRotation(early->rotation());
  const Eigen::Vector3d b = RpyFromRotation(late->rotation());
  const double change_rad = WrapAngle(b.x() - a.x());
  return Roll{time, change_rad / (2.0 * half_s), a.x() + 0.5 * change_rad};
}

void SonarTiming::Add(const GeoreferencedPing& ping, const std::optional<Roll>& before) {
  Head& head = heads_[ping.head];
  // Of several swaths with one time, the first is used.
  if (head.last && ping.time == head.last->time) return;
  std::optional<Look> now = LookAt(ping);
  if (head.last && before && before->time == head.last->time) {
    head.last->roll = *before;
    const std::optional<Look> earlier = std::exchange(head.before, head.last);
    if (earlier) Compare(*earlier, *head.last, &head);
  } else {
    head.before.reset();
  }
  head.last = std::move(now);
  if (head.roll.size() >= kPingsOfABlock) Finish(&head);
}

void SonarTiming::Compare(const Look& from, const Look& to, Head* head) {
  const double gap_s = ToSeconds(to.time - from.time);
  if (!(gap_s > 0.0 && gap_s < kLongestGapS)) return Finish(head);
  const double change_rad = to.slope_rad - from.slope_rad;
  head->rate.push_back({to.roll.rate_radps - from.roll.rate_radps, change_rad});
  head->roll.push_back({WrapAngle(to.roll.angle_rad - from.roll.angle_rad), change_rad});
  ++pings_;
}

void SonarTiming::Finish(Head* head) {
  by_rate_.AddBlock(head->rate);
  by_roll_.AddBlock(head->roll);
  head->rate.clear();
  head->roll.clear();
  head->before.reset();  // blocks share no ping
}

SonarTimingEstimate SonarTiming::estimate() const {
  SonarTimingEstimate estimate;
  // A stamp that is early by t changes slopes by -t times the change of the rate.
  if (const auto result = by_rate_.Estimate())
    estimate.roll =
        TimeOffsetEstimate{-result->factor, result->sigma, pings_, result->before, result->after};
  // A roll that is too small by a part s changes slopes by -s times the change of roll.
  if (const auto result = by_roll_.Estimate())
    estimate.roll_scale = RollScaleEstimate{-100.0 * result->factor, 100.0 * result->sigma};
  return estimate;
}

}  // namespace seastitch
