#include "mapper/noise/sonar_timing.hpp"

#include <Eigen/LU>
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
std::optional<Line> FitLine(const std::vector<Eigen::Vector3d>& level) {
  Weighted all;
  for (const Eigen::Vector3d& p : level) all.Add(1.0, p.y(), p.z());
  const std::optional<Line> first = all.Fit();
  if (!first) return std::nullopt;
  const auto off = [&](const Eigen::Vector3d& p) {
    return std::abs(p.z() - first->at_zero - first->slope * p.y());
  };
  double sum = 0.0;
  for (const Eigen::Vector3d& p : level) sum += off(p);
  const double bound = 2.0 * sum / static_cast<double>(level.size());
  Weighted bounded;
  for (const Eigen::Vector3d& p : level)
    bounded.Add(off(p) <= bound ? 1.0 : bound / off(p), p.y(), p.z());
  return bounded.Fit();
}

}  // namespace

void BlockRegression::Sums::Add(const Sums& other) {
  xx += other.xx;
  xy += other.xy;
  yy += other.yy;
  rows += other.rows;
}

BlockRegression::Vector BlockRegression::Factors() const {
  const Sums total = Total();
  const Vector factors = Inverse(total.xx) * total.xy;
  return factors.allFinite() ? factors : Vector::Zero();
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
  const Vector so_far = blocks_.size() < kFewestBlocks ? Vector::Zero() : Factors();
  const auto off = [&](const Row& row) { return std::abs(row.y - so_far.dot(row.x)); };
  std::vector<double> sizes;
  for (const Row& row : rows) sizes.push_back(off(row));
  const double bound = kBoundInMedians * Median(std::move(sizes));
  Sums sums;
  for (const Row& row : rows) {
    const double w = off(row) <= bound ? 1.0 : bound / off(row);
    sums.xx += w * row.x * row.x.transpose();
    sums.xy += w * row.y * row.x;
    sums.yy += w * row.y * row.y;
    sums.rows += 1.0;
  }
  if (!(sums.xx.allFinite() && std::isfinite(sums.yy))) return;
  blocks_.push_back(sums);
  if (blocks_.size() == kMostBlocks) JoinNeighbours();
}

// Inverse for one or two regressors; an absent one (xx(1, 1) = 0) gets zeros. Not finite if the two
// cannot be separated.
Eigen::Matrix2d BlockRegression::Inverse(const Eigen::Matrix2d& xx) {
  if (xx(1, 1) > 0.0) return xx.inverse();
  Eigen::Matrix2d inverse = Eigen::Matrix2d::Zero();
  inverse(0, 0) = 1.0 / xx(0, 0);
  return inverse;
}

std::optional<BlockRegression::Result> BlockRegression::Estimate() const {
  if (blocks_.size() < kFewestBlocks) return std::nullopt;
  const Sums total = Total();
  const Eigen::Matrix2d inverse = Inverse(total.xx);
  const Vector factors = inverse * total.xy;
  if (!factors.allFinite()) return std::nullopt;
  Eigen::Matrix2d scores = Eigen::Matrix2d::Zero();
  for (const Sums& block : blocks_) {
    const Vector score = block.xy - block.xx * factors;
    scores += score * score.transpose();
  }
  const auto n = static_cast<double>(blocks_.size());
  const Eigen::Matrix2d covariance = n / (n - 1.0) * inverse * scores * inverse;
  const double after = total.yy - 2.0 * factors.dot(total.xy) + factors.dot(total.xx * factors);
  return Result{factors[0],
                std::sqrt(covariance(0, 0)),
                std::sqrt(total.yy / total.rows),
                std::sqrt(std::max(0.0, after) / total.rows)};
}

std::optional<SonarTiming::Look> SonarTiming::LookAt(const GeoreferencedPing& ping) {
  if (static_cast<int>(ping.soundings.size()) < kFewestSoundings) return std::nullopt;
  const Eigen::Vector3d vehicle = ping.T_map_vehicle.translation();
  const double yaw = LevelPose(ping.T_map_vehicle).yaw;
  const Eigen::Vector2d ahead(std::cos(yaw), std::sin(yaw));
  const Eigen::Vector2d starboard(-ahead.y(), ahead.x());
  std::vector<Eigen::Vector3d> level;  // forward, starboard, down from the vehicle
  level.reserve(ping.soundings.size());
  double way_m = 0.0;
  for (const Sounding& sounding : ping.soundings) {
    const Eigen::Vector3d p = sounding.p_map - vehicle;
    level.emplace_back(ahead.dot(p.head<2>()), starboard.dot(p.head<2>()), p.z());
    way_m += level.back().x();
  }
  way_m /= static_cast<double>(level.size());
  const std::optional<Line> line = FitLine(level);
  if (!line || !(line->at_zero > 0.0)) return std::nullopt;
  Look look;
  look.time = ping.time;
  look.slope_rad = std::atan(line->slope);
  look.depth_m = vehicle.z() + line->at_zero;
  look.altitude_m = line->at_zero;
  look.ahead = ahead;
  look.p_map = vehicle.head<2>() + way_m * ahead;
  return look;
}

bool SonarTiming::AddRates(const PoseLookup& T_map_vehicle_at, double gap_s, Look* look) {
  const double half_s = std::min(gap_s, kMostHalfRateS);
  if (!(half_s > 0.0)) return false;
  const auto early = T_map_vehicle_at(look->time - FromSeconds(half_s));
  const auto late = T_map_vehicle_at(look->time + FromSeconds(half_s));
  if (!early || !late) return false;
  const Eigen::Vector3d a = RpyFromRotation(early->rotation());
  const Eigen::Vector3d b = RpyFromRotation(late->rotation());
  look->roll_rate_radps = WrapAngle(b.x() - a.x()) / (2.0 * half_s);
  look->pitch_rate_radps = WrapAngle(b.y() - a.y()) / (2.0 * half_s);
  look->sink_rate_mps = (late->translation().z() - early->translation().z()) / (2.0 * half_s);
  return true;
}

void SonarTiming::Add(const GeoreferencedPing& ping, const PoseLookup& T_map_vehicle_at) {
  Head& head = heads_[ping.head];
  // Of several swaths with one time, the first is used.
  if (head.last && ping.time == head.last->time) return;
  std::optional<Look> now = LookAt(ping);
  if (head.last &&
      AddRates(T_map_vehicle_at, ToSeconds(ping.time - head.last->time), &*head.last)) {
    const std::optional<Look> before = std::exchange(head.before, head.last);
    if (before) Compare(*before, *head.last, &head);
  } else {
    head.before.reset();
  }
  head.last = std::move(now);
  if (head.roll.size() >= kPingsOfABlock) Finish(&head);
}

void SonarTiming::Compare(const Look& from, const Look& to, Head* head) {
  const double gap_s = ToSeconds(to.time - from.time);
  if (!(gap_s > 0.0 && gap_s < kLongestGapS)) return Finish(head);
  head->roll.push_back(
      {{to.roll_rate_radps - from.roll_rate_radps, 0.0}, to.slope_rad - from.slope_rad});
  head->along.push_back({to.depth_m - from.depth_m,
                         from.ahead.dot(to.p_map - from.p_map),
                         0.5 * (from.altitude_m + to.altitude_m),
                         to.pitch_rate_radps - from.pitch_rate_radps,
                         to.sink_rate_mps - from.sink_rate_mps});
  ++pings_;
}

// Ends a block. An error of roll adds to the slope across the track. An error of pitch puts the
// soundings altitude x pitch too far forward, where the seabed is deeper by that distance times its
// slope. With a late stamp the depth of the vehicle is taken after it sank further.
void SonarTiming::Finish(Head* head) {
  roll_.AddBlock(head->roll);
  double depth_m = 0.0;
  double way_m = 0.0;
  for (const Head::Along& a : head->along) {
    depth_m += a.depth_m;
    way_m += a.way_m;
  }
  if (std::abs(way_m) > 1.0) {
    const double slope = depth_m / way_m;
    std::vector<BlockRegression::Row> rows;
    for (const Head::Along& a : head->along)
      rows.push_back({{-slope * a.altitude_m * a.pitch_rate_radps, a.sink_rate_mps},
                      a.depth_m - slope * a.way_m});
    pitch_.AddBlock(rows);
  }
  head->roll.clear();
  head->along.clear();
  head->before.reset();  // blocks share no ping
}

SonarTimingEstimate SonarTiming::estimate() const {
  // A stamp that is early by t changes slopes by -t times the change of the rate.
  const auto of = [&](const BlockRegression& regression) -> std::optional<TimeOffsetEstimate> {
    const auto result = regression.Estimate();
    if (!result) return std::nullopt;
    return TimeOffsetEstimate{
        -result->factor, result->sigma, pings_, result->before, result->after};
  };
  SonarTimingEstimate estimate;
  estimate.roll = of(roll_);
  estimate.pitch = of(pitch_);
  return estimate;
}

}  // namespace seastitch
