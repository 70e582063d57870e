#include "mapper/calibration/calibration_cells.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/core/calibration.hpp"
#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "mapper/geometry/calibrated_motion.hpp"

namespace seastitch {
namespace {

constexpr double kSoundSpeedMps = SonarCalibration::kSmileSpeedMps;
// Soundings beyond it are refracted too much for these derivatives.
constexpr double kMaxAngle_rad = Deg2Rad(65.0);
constexpr double kMinSoundings = 3.0;
constexpr double kMaxSlope = 1.0;
// About so many soundings of a cell are used: more add no information, because errors of
// neighbours are alike.
constexpr std::size_t kEnoughPerCell = 24;

using CellKey = std::pair<std::int32_t, std::int32_t>;

CellKey KeyOf(const Eigen::Vector2d& p, double cell_m) {
  return {static_cast<std::int32_t>(std::floor(p.x() / cell_m)),
          static_cast<std::int32_t>(std::floor(p.y() / cell_m))};
}

// Sums over soundings, about a corner of their cell.
struct Moments {
  double n = 0.0, x = 0.0, y = 0.0, z = 0.0;
  double xx = 0.0, xy = 0.0, yy = 0.0, xz = 0.0, yz = 0.0, zz = 0.0;

  void Add(const Eigen::Vector3d& p) {
    n += 1.0;
    x += p.x();
    y += p.y();
    z += p.z();
    xx += p.x() * p.x();
    xy += p.x() * p.y();
    yy += p.y() * p.y();
    xz += p.x() * p.z();
    yz += p.y() * p.z();
    zz += p.z() * p.z();
  }
  void Add(const Moments& m) {
    n += m.n;
    x += m.x;
    y += m.y;
    z += m.z;
    xx += m.xx;
    xy += m.xy;
    yy += m.yy;
    xz += m.xz;
    yz += m.yz;
    zz += m.zz;
  }
};

struct Plane {
  Eigen::Vector3d mean;
  Eigen::Vector2d slope;
  double scatter_m;
};

// Plane through soundings; nothing where they do not determine it.
std::optional<Plane> PlaneOf(const Moments& m, double cell_m) {
  constexpr double kEnough = 8.0;
  if (m.n < kEnough) return std::nullopt;
  const Eigen::Vector3d mean(m.x / m.n, m.y / m.n, m.z / m.n);
  const double xx = m.xx / m.n - mean.x() * mean.x();
  const double yy = m.yy / m.n - mean.y() * mean.y();
  const double xy = m.xy / m.n - mean.x() * mean.y();
  const double xz = m.xz / m.n - mean.x() * mean.z();
  const double yz = m.yz / m.n - mean.y() * mean.z();
  const double zz = m.zz / m.n - mean.z() * mean.z();
  const double det = xx * yy - xy * xy;
  if (!(det > 0.02 * std::pow(cell_m, 4))) return std::nullopt;
  const Eigen::Vector2d slope((xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det);
  const double rest = zz - slope.x() * xz - slope.y() * yz;
  return Plane{mean, slope, std::sqrt(std::max(rest, 1e-8))};
}

// Motion of the vehicle at a ping, with its rates.
struct MotionAt {
  Time time;
  std::uint8_t head;
  SubmapSoundings::Motion motion;
  Eigen::Matrix3d R_level_vehicle;
  Eigen::Vector3d rpy_rate = Eigen::Vector3d::Zero();  // [rad/s]
  double sink_mps = 0.0;
  double heave_m = 0.0;
};

// Between neighbouring pings: rates are those of the way from the ping before to the one after.
std::vector<MotionAt> MotionsOf(const SubmapSoundings& submap) {
  std::vector<MotionAt> motions;
  for (std::size_t i = 0; i < submap.motions.size(); ++i) {
    const Eigen::Vector3d& rpy = submap.motions[i].rpy_rad;
    motions.push_back({.time = submap.pings[i].time,
                       .head = submap.pings[i].head,
                       .motion = submap.motions[i],
                       .R_level_vehicle = RotationFromRpy(rpy.x(), rpy.y(), rpy.z())});
  }
  std::vector<DepthAt> depths;
  for (const MotionAt& at : motions) depths.push_back({at.time, at.motion.p_level_m.z()});
  const std::size_t n = motions.size();
  for (std::size_t i = 0; i < n; ++i) {
    motions[i].heave_m = HeaveAt(depths, motions[i].time);
    std::size_t a = i, b = i;
    while (a > 0 && motions[a].time == motions[i].time) --a;
    while (b + 1 < n && motions[b].time == motions[i].time) ++b;
    const double dt_s = ToSeconds(motions[b].time - motions[a].time);
    if (!(dt_s > 0.0)) continue;
    for (int k = 0; k < 3; ++k)
      motions[i].rpy_rate[k] =
          WrapAngle(motions[b].motion.rpy_rad[k] - motions[a].motion.rpy_rad[k]) / dt_s;
    motions[i].sink_mps =
        (motions[b].motion.p_level_m.z() - motions[a].motion.p_level_m.z()) / dt_s;
  }
  return motions;
}

// Motion a moment after a ping, carried on by its rates and those of the next.
MotionAt After(const std::vector<MotionAt>& motions, std::size_t i, double after_s) {
  MotionAt at = motions[i];
  at.motion.rpy_rad += after_s * at.rpy_rate;
  std::size_t next = i;
  while (next + 1 < motions.size() && motions[next].time == motions[i].time) ++next;
  const double dt_s = ToSeconds(motions[next].time - motions[i].time);
  if (!(dt_s > 0.0)) return at;
  const double w = std::min(1.0, after_s / dt_s);
  at.rpy_rate += w * (motions[next].rpy_rate - motions[i].rpy_rate);
  at.sink_mps += w * (motions[next].sink_mps - motions[i].sink_mps);
  return at;
}

// Displacements of a sounding at p by each error [m per unit]: columns as IntegrationError.
using Displacements = Eigen::Matrix<double, 3, kIntegrationErrors>;

Displacements DisplacementsOf(const Eigen::Vector3d& p,
                              const MotionAt& tx,
                              const MotionAt& rx,
                              const Eigen::Isometry3d& T_vehicle_sonar) {
  const Eigen::Vector3d& rpy = tx.motion.rpy_rad;
  const Eigen::Matrix3d& R = tx.R_level_vehicle;
  const Eigen::Vector3d from_vehicle = p - tx.motion.p_level_m;
  const Eigen::Vector3d r = from_vehicle - R * T_vehicle_sonar.translation();
  const Eigen::Vector3d forward = R.col(0), starboard = R.col(1), down = R.col(2);
  const Eigen::Vector3d level_starboard(-std::sin(rpy.z()), std::cos(rpy.z()), 0.0);
  // Steering is about the axes of the array, which may be mounted at an angle.
  const Eigen::Matrix3d R_array = R * T_vehicle_sonar.linear();
  const double across = R_array.col(1).dot(r), below = R_array.col(2).dot(r);
  const Eigen::Vector3d rolled = forward.cross(from_vehicle);
  const auto column = [](IntegrationError e) { return static_cast<Eigen::Index>(e); };
  Displacements J;
  const bool is_second = tx.head == 1;
  J.col(column(is_second ? IntegrationError::kSecondHeadRoll : IntegrationError::kRoll)) =
      forward.cross(r);
  J.col(column(is_second ? IntegrationError::kRoll : IntegrationError::kSecondHeadRoll)).setZero();
  J.col(column(IntegrationError::kSmile)) =
      R_array * Eigen::Vector3d(0.0, across, -across * across / below);
  J.col(column(IntegrationError::kAttitudeLatency)) =
      rx.rpy_rate.x() * rolled + tx.rpy_rate.y() * level_starboard.cross(from_vehicle) +
      tx.rpy_rate.z() * Eigen::Vector3d::UnitZ().cross(from_vehicle);
  J.col(column(IntegrationError::kDepthLatency)) =
      Eigen::Vector3d(0.0, 0.0, 0.5 * (tx.sink_mps + rx.sink_mps));
  J.col(column(IntegrationError::kRollScale)) = rx.motion.rpy_rad.x() * rolled;
  J.col(column(IntegrationError::kHeaveScale)) = Eigen::Vector3d(0.0, 0.0, tx.heave_m);
  J.col(column(IntegrationError::kPitch)) = starboard.cross(r);
  J.col(column(IntegrationError::kYaw)) = down.cross(r);
  J.col(column(IntegrationError::kProfile)) =
      Eigen::Vector3d(2.0 * r.x(), 2.0 * r.y(), r.z() - r.head<2>().squaredNorm() / r.z());
  J.col(column(IntegrationError::kForward)) = forward;
  J.col(column(IntegrationError::kStarboard)) = starboard;
  return J;
}

// A cell while soundings are added.
struct Sum {
  Moments moments;
  std::optional<Plane> plane;  // of the nine cells around it
  double n = 0.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double residual2 = 0.0, residual = 0.0, angle = 0.0;
  Eigen::Matrix<double, kIntegrationErrors, 1> by_error =
      Eigen::Matrix<double, kIntegrationErrors, 1>::Zero();
};

// A used sounding.
struct Placed {
  Eigen::Vector3d p_level;
  std::size_t ping;
};

// Cells of a rectangle, of which many may be empty.
class Sums {
 public:
  // Nothing where the rectangle would be implausibly large.
  static std::optional<Sums> Around(const std::vector<Placed>& soundings, double cell_m) {
    Eigen::AlignedBox2d box;
    for (const Placed& s : soundings) box.extend(s.p_level.head<2>());
    Sums sums;
    sums.cell_m_ = cell_m;
    sums.first_ = KeyOf(box.min(), cell_m);
    const CellKey last = KeyOf(box.max(), cell_m);
    const double width = static_cast<double>(last.first) - sums.first_.first + 1.0;
    const double height = static_cast<double>(last.second) - sums.first_.second + 1.0;
    if (!(width * height <= kMostCells)) return std::nullopt;
    sums.width_ = last.first - sums.first_.first + 1;
    sums.height_ = last.second - sums.first_.second + 1;
    sums.cells_.resize(static_cast<std::size_t>(sums.width_ * sums.height_));
    return sums;
  }

  Sum& At(const Eigen::Vector2d& p) {
    const CellKey key = KeyOf(p, cell_m_);
    return *Find(key.first - first_.first, key.second - first_.second);
  }
  std::size_t used() const {
    return static_cast<std::size_t>(std::count_if(
        cells_.begin(), cells_.end(), [](const Sum& sum) { return sum.moments.n > 0.0; }));
  }
  const std::vector<Sum>& cells() const { return cells_; }

  void FitPlanes() {
    for (std::int32_t i = 0; i < width_; ++i)
      for (std::int32_t j = 0; j < height_; ++j) {
        Sum& sum = *Find(i, j);
        if (!(sum.moments.n > 0.0)) continue;
        Moments around;
        for (std::int32_t k = -1; k <= 1; ++k)
          for (std::int32_t l = -1; l <= 1; ++l)
            if (const Sum* near = Find(i + k, j + l)) around.Add(near->moments);
        sum.plane = PlaneOf(around, cell_m_);
        if (sum.plane && sum.plane->slope.norm() > kMaxSlope) sum.plane.reset();
      }
  }

 private:
  static constexpr double kMostCells = 2e5;
  Sum* Find(std::int32_t i, std::int32_t j) {
    if (i < 0 || j < 0 || i >= width_ || j >= height_) return nullptr;
    return &cells_[static_cast<std::size_t>(i) * static_cast<std::size_t>(height_) +
                   static_cast<std::size_t>(j)];
  }

  double cell_m_ = 1.0;
  CellKey first_{};
  std::int32_t width_ = 0;
  std::int32_t height_ = 0;
  std::vector<Sum> cells_;
};

double MedianAltitude(const std::vector<Placed>& soundings,
                      const std::vector<SubmapSoundings::Motion>& motions) {
  std::vector<double> below;
  for (std::size_t i = 0; i < soundings.size(); i += 97)
    below.push_back(soundings[i].p_level.z() - motions[soundings[i].ping].p_level_m.z());
  return Median(std::move(below));
}

bool AreOf(std::size_t heads, const SubmapSoundings& submap) {
  constexpr std::size_t kMostHeads = 2;
  return std::all_of(submap.pings.begin(), submap.pings.end(), [&](const auto& ping) {
    return ping.head < std::min(heads, kMostHeads);
  });
}

void AddTo(Sum* sum,
           const Placed& sounding,
           const std::vector<MotionAt>& motions,
           const Eigen::Isometry3d& T_vehicle_sonar,
           double cell_m) {
  const auto& [p, ping] = sounding;
  const Plane& plane = *sum->plane;
  const double residual = p.z() - plane.mean.z() - plane.slope.dot((p - plane.mean).head<2>());
  if (std::abs(residual) > std::max(5.0 * plane.scatter_m, 0.15)) return;
  const MotionAt& tx = motions[ping];
  // To the middle of the cell across the track, on the plane.
  const CellKey key = KeyOf(p.head<2>(), cell_m);
  const Eigen::Vector2d middle((key.first + 0.5) * cell_m, (key.second + 0.5) * cell_m);
  const Eigen::Vector2d starboard(-std::sin(tx.motion.rpy_rad.z()),
                                  std::cos(tx.motion.rpy_rad.z()));
  Eigen::Vector3d at;
  at.head<2>() = p.head<2>() + starboard.dot(middle - p.head<2>()) * starboard;
  at.z() = plane.mean.z() + plane.slope.dot((at - plane.mean).head<2>());
  const Eigen::Vector3d way = at - tx.motion.p_level_m;
  const double angle_rad = std::atan2(way.head<2>().norm(), way.z());
  if (!(angle_rad < kMaxAngle_rad)) return;
  const MotionAt rx = After(motions, ping, 2.0 * way.norm() / kSoundSpeedMps);
  const Displacements J = DisplacementsOf(at, tx, rx, T_vehicle_sonar);
  sum->n += 1.0;
  sum->mean += p;
  sum->residual += residual;
  sum->residual2 += residual * residual;
  sum->angle += angle_rad;
  sum->by_error += J.row(2).transpose() - J.topRows<2>().transpose() * plane.slope;
}

CalibrationCell CellOf(const Sum& sum) {
  CalibrationCell cell;
  const Eigen::Vector3f mean = (sum.mean / sum.n).cast<float>();
  cell.mean_m = {mean.x(), mean.y(), mean.z()};
  cell.slope = {static_cast<float>(sum.plane->slope.x()), static_cast<float>(sum.plane->slope.y())};
  for (std::size_t k = 0; k < kIntegrationErrors; ++k)
    cell.by_error[k] = static_cast<float>(sum.by_error[static_cast<Eigen::Index>(k)] / sum.n);
  cell.angle_rad = static_cast<float>(sum.angle / sum.n);
  const double mean_residual = sum.residual / sum.n;
  const double variance = sum.residual2 / sum.n - mean_residual * mean_residual;
  cell.variance_m2 = static_cast<float>(std::max(0.0, variance) * sum.n / (sum.n - 1.0));
  cell.soundings = static_cast<float>(sum.n);
  return cell;
}

}  // namespace

void CalibrationCells::Sort() {
  std::sort(cells.begin(), cells.end(), [this](const CalibrationCell& a, const CalibrationCell& b) {
    return KeyOf({a.mean_m[0], a.mean_m[1]}, cell_m) < KeyOf({b.mean_m[0], b.mean_m[1]}, cell_m);
  });
}

const CalibrationCell* CalibrationCells::At(const Eigen::Vector2d& p_level_m) const {
  const CellKey key = KeyOf(p_level_m, cell_m);
  const auto key_of = [this](const CalibrationCell& cell) {
    return KeyOf({cell.mean_m[0], cell.mean_m[1]}, cell_m);
  };
  const auto found = std::lower_bound(
      cells.begin(), cells.end(), key, [&](const CalibrationCell& cell, const CellKey& wanted) {
        return key_of(cell) < wanted;
      });
  return found != cells.end() && key_of(*found) == key ? &*found : nullptr;
}

CalibrationCells CellsOf(const SubmapSoundings& submap, const SonarHeads& T_vehicle_sonar) {
  CalibrationCells result;
  if (submap.motions.size() != submap.pings.size() || submap.pings.empty() ||
      !AreOf(T_vehicle_sonar.size(), submap))
    return result;
  std::vector<Placed> soundings;
  for (const SubmapSoundings::Sounding& s : submap.soundings)
    if (s.used) soundings.push_back({submap.R_level_submap * s.p_submap_m.cast<double>(), s.ping});
  if (soundings.empty()) return result;
  result.cell_m = kCellPerAltitude * MedianAltitude(soundings, submap.motions);
  if (!(result.cell_m > 0.01)) return result;

  std::optional<Sums> sums = Sums::Around(soundings, result.cell_m);
  if (!sums) return result;
  for (const Placed& s : soundings) sums->At(s.p_level.head<2>()).moments.Add(s.p_level);
  sums->FitPlanes();
  const std::vector<MotionAt> motions = MotionsOf(submap);
  const std::size_t every =
      std::max<std::size_t>(1, soundings.size() / (kEnoughPerCell * sums->used()));
  for (std::size_t i = 0; i < soundings.size(); i += every) {
    const Placed& s = soundings[i];
    Sum& sum = sums->At(s.p_level.head<2>());
    if (sum.plane) AddTo(&sum, s, motions, T_vehicle_sonar[motions[s.ping].head], result.cell_m);
  }
  for (const Sum& sum : sums->cells())
    if (sum.n >= kMinSoundings) result.cells.push_back(CellOf(sum));
  result.Sort();
  return result;
}

}  // namespace seastitch
