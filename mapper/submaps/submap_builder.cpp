#include "mapper/submaps/submap_builder.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/core/median.hpp"
#include "mapper/submaps/eigenvalues.hpp"
#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/level_cloud.hpp"
#include "mapper/submaps/relative_pose.hpp"

namespace seastitch {
namespace {

// Distance between two checks of drift and information: each check computes over thousands of
// cells.
constexpr double kCheckEveryM = 5.0;
// Cell for slopes, as a fraction of the altitude: contains several beams and pings.
constexpr double kCellPerAltitude = 0.05;
// The median of five tolerates two outliers. Its variance is 1.43 times that of the mean.
constexpr std::size_t kBeamsPerMedian = 5;
constexpr double kMedianVariance = 1.43;
constexpr std::size_t kNoVoxel = static_cast<std::size_t>(-1);

const char* NameOf(SoundingGate gate) {
  switch (gate) {
    case SoundingGate::kPass: return "soundings_passed";
    case SoundingGate::kNotFinite: return "soundings_not_finite";
    case SoundingGate::kAboveVehicle: return "soundings_above_vehicle";
    case SoundingGate::kTooNear: return "soundings_too_near";
    case SoundingGate::kTooFar: return "soundings_too_far";
  }
  return "soundings_passed";
}

double MedianHeightBelow(const GeoreferencedPing& ping) {
  std::vector<double> below;
  for (const Sounding& s : ping.soundings) {
    below.push_back(s.p_map.z() - ping.T_map_vehicle.translation().z());
  }
  return Median(std::move(below));
}

// Most swaths of one ping. More pings of one time are those of a clock that stands still.
constexpr std::ptrdiff_t kMaxSwaths = 4;

double HorizontalStep(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (b.translation() - a.translation()).head<2>().norm();
}

// True if the covariance is smaller in every horizontal direction and in yaw.
bool IsBetter(const Eigen::Matrix3d& covariance, const Eigen::Matrix3d& than) {
  const Eigen::Matrix3d gained = than - covariance;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> horizontal(
      Eigen::Matrix2d(gained.topLeftCorner<2, 2>()));
  return horizontal.eigenvalues()(0) > 0.0 && gained(2, 2) > 0.0;
}

}  // namespace

SubmapBuilder::Open::Open(const Eigen::Vector3d& p_map_vehicle,
                          const CloudFilterParams& filter,
                          double cell_m)
    : voxels(p_map_vehicle, filter.voxel_m), terrain(cell_m) {}

SubmapBuilder::SubmapBuilder(const SubmapParams& params,
                             const CloudFilterParams& filter,
                             Drift drift,
                             Hindsight hindsight)
    : params_(params),
      filter_(filter),
      drift_(std::move(drift)),
      hindsight_(std::move(hindsight)) {}

std::optional<Submap> SubmapBuilder::Add(Ping added) {
  if (!Accept(added)) return std::nullopt;
  const GeoreferencedPing& ping = *added;
  std::optional<Submap> closed;
  if (const auto trigger = Break(ping)) {
    closed = Close(*trigger);
    if (HasLeftHeading(ping)) EndLine();
    turning_ = false;
    headings_.clear();
  } else {
    if (!last_ && !frames_.empty() && HasLeftHeading(ping)) EndLine();  // after a restart
    if (last_) {
      const double step_m = HorizontalStep(last_->T_map_vehicle, ping.T_map_vehicle);
      along_m_ += step_m;
      if (open_) open_->length_m += step_m;
    }
    if (TurnBefore(ping)) {
      closed = Close(SubmapTrigger::kTurn);
      EndLine();
    }
  }
  last_ = Pose{ping.time, ping.T_map_vehicle};
  if (turning_ && !params_.keep_turns) {
    ++pings_in_turns_;
    return closed;
  }
  AddPing(added);
  if (!closed) {
    if (const auto trigger = Full()) closed = Close(*trigger);
  }
  return closed;
}

std::optional<Time> SubmapBuilder::frame_time() const {
  if (!open_) return std::nullopt;
  return open_->track[open_->track.size() / 2].time;
}

Counters SubmapBuilder::counters() const {
  Counters all = soundings_lost();
  pings_lost_.AddTo(&all);
  if (pings_in_turns_ > 0) all["pings_in_turns"] = pings_in_turns_;
  if (submaps_too_small_ > 0) all["submaps_too_small"] = submaps_too_small_;
  return all;
}

std::optional<Submap> SubmapBuilder::Finish() { return Close(SubmapTrigger::kEnd); }

bool SubmapBuilder::Accept(const Ping& ping) {
  if (!ping->T_map_vehicle.matrix().allFinite()) {
    pings_lost_.Add(PingLoss::kNotFinite);
    return false;
  }
  if (last_ && ping->time > last_->time) swaths_.clear();
  if ((last_ && ping->time < last_->time) || !IsNew(*ping)) {
    pings_lost_.Add(PingLoss::kOutOfOrder);
    return false;
  }
  swaths_.push_back(ping);
  return true;
}

bool SubmapBuilder::IsNew(const GeoreferencedPing& ping) const {
  const auto is_of_head = [&](const Ping& swath) { return swath->head == ping.head; };
  const auto of_head = std::count_if(swaths_.begin(), swaths_.end(), is_of_head);
  if (of_head == 0) return true;
  if (of_head >= kMaxSwaths) return false;
  jobs_->Finish();
  const auto first = [](const GeoreferencedPing& swath) {
    return swath.soundings.empty() ? Eigen::Vector3d::Zero().eval() : swath.soundings[0].p_map;
  };
  return std::none_of(swaths_.begin(), swaths_.end(), [&](const Ping& swath) {
    return is_of_head(swath) && first(*swath) == first(ping);
  });
}

std::optional<SubmapTrigger> SubmapBuilder::Break(const GeoreferencedPing& ping) const {
  if (!last_) return std::nullopt;
  const bool late = ToSeconds(ping.time - last_->time) > params_.max_gap_s;
  const bool far = HorizontalStep(last_->T_map_vehicle, ping.T_map_vehicle) > params_.max_gap_m;
  return late || far ? std::optional(SubmapTrigger::kGap) : std::nullopt;
}

bool SubmapBuilder::TurnBefore(const GeoreferencedPing& ping) {
  if (turning_) {
    if (!HeadingSettled(LevelPose(ping.T_map_vehicle).yaw, along_m_)) return false;
    turning_ = false;
    headings_.clear();
    return true;
  }
  if (!open_) return false;
  if (!HasLeftHeading(ping)) {
    open_->turned_since_m = -1.0;
    return false;
  }
  if (open_->turned_since_m < 0.0) open_->turned_since_m = open_->length_m;
  turning_ = open_->length_m - open_->turned_since_m >= params_.turn_sustain_m;
  return turning_;
}

bool SubmapBuilder::HasLeftHeading(const GeoreferencedPing& ping) const {
  return std::abs(WrapAngle(LevelPose(ping.T_map_vehicle).yaw - first_yaw_rad_)) > params_.turn_rad;
}

bool SubmapBuilder::HeadingSettled(double yaw_rad, double along_m) {
  // Ten headings over the distance are enough. A hovering vehicle adds none.
  if (headings_.empty() || along_m - headings_.back().along_m >= 0.1 * params_.turn_settle_m) {
    headings_.push_back({along_m, yaw_rad});
  }
  while (headings_.size() > 1 && along_m - headings_[1].along_m >= params_.turn_settle_m) {
    headings_.pop_front();
  }
  if (along_m - headings_.front().along_m < params_.turn_settle_m) return false;
  return std::all_of(headings_.begin(), headings_.end(), [&](const Heading& h) {
    return std::abs(WrapAngle(h.yaw_rad - yaw_rad)) < 0.5 * params_.turn_rad;
  });
}

void SubmapBuilder::AddPing(const Ping& added) {
  const GeoreferencedPing& ping = *added;
  if (!open_) {
    // A submap starts at its first sounding.
    jobs_->Finish();
    if (ping.soundings.empty()) {
      pings_lost_.Add(PingLoss::kWithoutSoundings);
      return;
    }
    const double altitude_m = MedianHeightBelow(ping);
    const double cell_m = std::isfinite(altitude_m) ? kCellPerAltitude * altitude_m : 0.0;
    open_.emplace(
        ping.T_map_vehicle.translation(), filter_, std::max(cell_m, 2.0 * filter_.voxel_m));
    open_->next_check_m = params_.min_length_m;
    first_yaw_rad_ = LevelPose(ping.T_map_vehicle).yaw;
  }
  const Time anchor = open_->track.empty() ? ping.time : open_->track.front().time;
  const Pose2 level = hindsight_(anchor, ping.time);
  const Eigen::Isometry3d T_anchored_map =
      MakePose({level.x, level.y, 0.0}, RotationFromRpy(0.0, 0.0, level.yaw));
  open_->track.push_back({{ping.time, ping.T_map_vehicle}, T_anchored_map * ping.T_map_vehicle});
  open_->sum_dvl_yaw_rad += ping.dvl_yaw_rad;
  if (!ping.bottom_lock) {
    if (!open_->first_without_lock) open_->first_without_lock = ping.time;
    open_->last_without_lock = ping.time;
  }
  open_->soundings_read += static_cast<std::uint64_t>(std::max(0, ping.beams_read));
  jobs_->Add([this, added, T_anchored_map, number = open_->track.size()] {
    AddSoundings(*added, T_anchored_map, static_cast<std::uint32_t>(number));
  });
}

void SubmapBuilder::AddSoundings(const GeoreferencedPing& ping,
                                 const Eigen::Isometry3d& T_anchored_map,
                                 std::uint32_t number) {
  std::array<Eigen::Vector3d, kBeamsPerMedian> group;
  std::size_t grouped = 0;
  const Eigen::Vector3d p_map_vehicle = ping.T_map_vehicle.translation();
  if (keeps_soundings_) {
    open_->soundings.pings.push_back({ping.time, ping.ping_number, ping.head});
    open_->soundings.motions.emplace_back();
  }
  for (const Sounding& sounding : ping.soundings) {
    const SoundingGate gate = CheckSounding(sounding.p_map, p_map_vehicle, filter_);
    const Eigen::Vector3d p_anchored = T_anchored_map * sounding.p_map;
    if (gate != SoundingGate::kPass) {
      ++soundings_lost_[NameOf(gate)];
      Keep(sounding, p_anchored, kNoVoxel);
      continue;
    }
    const double sigma_m =
        std::max(params_.sounding_sigma_m, static_cast<double>(sounding.depth_sigma_m));
    const std::size_t voxel = open_->voxels.Add(p_anchored, 1.0 / (sigma_m * sigma_m), number);
    Keep(sounding, p_anchored, voxel);
    open_->sum_variance_m2 += sigma_m * sigma_m;
    group[grouped++] = p_anchored;
    if (grouped < kBeamsPerMedian) continue;
    grouped = 0;
    std::nth_element(
        group.begin(),
        group.begin() + kBeamsPerMedian / 2,
        group.end(),
        [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.z() < b.z(); });
    open_->terrain.Add(group[kBeamsPerMedian / 2] - open_->voxels.p_map_origin(),
                       static_cast<double>(kBeamsPerMedian),
                       kMedianVariance * sigma_m * sigma_m);
  }
}

void SubmapBuilder::Keep(const Sounding& sounding,
                         const Eigen::Vector3d& p_anchored,
                         std::size_t voxel) {
  if (!keeps_soundings_ || !p_anchored.allFinite()) return;
  open_->soundings.soundings.push_back(
      {(p_anchored - open_->voxels.p_map_origin()).cast<float>(),
       static_cast<std::uint32_t>(open_->soundings.pings.size() - 1),
       static_cast<std::uint16_t>(sounding.beam)});
  open_->voxel_of_sounding.push_back(voxel);
}

std::optional<SubmapTrigger> SubmapBuilder::Full() {
  if (!open_) return std::nullopt;
  if (open_->length_m >= params_.max_length_m ||
      ToSeconds(open_->track.back().time - open_->track.front().time) >= params_.max_duration_s ||
      IsFullOfSoundings())
    return SubmapTrigger::kLength;
  if (open_->length_m >= open_->next_check_m) {
    open_->next_check_m = open_->length_m + kCheckEveryM;
    if (HasDrifted()) return SubmapTrigger::kLength;
    if (HoldsEnoughStructure()) return SubmapTrigger::kInformation;
  }
  return std::nullopt;
}

bool SubmapBuilder::IsFullOfSoundings() const {
  const auto most = static_cast<std::size_t>(params_.max_soundings);
  if (open_->soundings_read < most) return false;
  jobs_->Finish();
  return open_->voxels.soundings() >= most;
}

bool SubmapBuilder::HasDrifted() const {
  const std::optional<Eigen::Matrix3d> lost =
      drift_(open_->track.front().time, open_->track.back().time);
  return !lost || WorstSigma(lost->topLeftCorner<2, 2>()) > params_.max_drift_m;
}

bool SubmapBuilder::HoldsEnoughStructure() const {
  jobs_->Finish();
  const AnchoredPose& middle = open_->track[open_->track.size() / 2];
  const Time neighbour = NearestOnEarlierLine(middle.T_map_vehicle.translation().head<2>());
  Pose2 frame = LevelPose(middle.T_anchored_vehicle);
  frame.x -= open_->voxels.p_map_origin().x();
  frame.y -= open_->voxels.p_map_origin().y();
  const Eigen::Matrix3d information = params_.expected_overlap * open_->terrain.Evaluate(frame);
  const Eigen::LLT<Eigen::Matrix3d> factor(information);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::Matrix3d registered = factor.solve(Eigen::Matrix3d::Identity());
  const std::optional<Eigen::Matrix3d> drift = drift_(middle.time, neighbour);
  return !drift || IsBetter(registered, *drift);
}

// Time of the nearest frame on an earlier line. While all is one line, the start: the next
// neighbour is then assumed to be as far away as the start.
Time SubmapBuilder::NearestOnEarlierLine(const Eigen::Vector2d& p_map) const {
  if (frames_.empty()) return open_->track.front().time;
  if (on_earlier_lines_ == 0) return frames_.front().time;
  const auto end = frames_.begin() + static_cast<std::ptrdiff_t>(on_earlier_lines_);
  return std::min_element(frames_.begin(),
                          end,
                          [&](const Frame& a, const Frame& b) {
                            return (a.p_map - p_map).squaredNorm() <
                                   (b.p_map - p_map).squaredNorm();
                          })
      ->time;
}

// Within a part without bottom lock navigation moves no pose, so that the covariance between its
// ends is the drift with which the submap was built. Of several such parts it is too large.
double SubmapBuilder::DriftPerM(const Open& open) const {
  if (!open.first_without_lock || open.length_m <= 0.0) return 0.0;
  const auto drift = drift_(*open.first_without_lock, open.last_without_lock);
  const double drift_m = drift ? WorstSigma(drift->topLeftCorner<2, 2>()) : open.length_m;
  return std::min(1.0, drift_m / open.length_m);
}

double SubmapBuilder::HeadingSpread(const std::vector<AnchoredPose>& track, double frame_yaw_rad) {
  double sum = 0.0;
  for (const AnchoredPose& pose : track) {
    const double half = 0.5 * (LevelPose(pose.T_map_vehicle).yaw - frame_yaw_rad);
    sum += 4.0 * std::sin(half) * std::sin(half);
  }
  return std::sqrt(sum / static_cast<double>(track.size()));
}

std::optional<Submap> SubmapBuilder::Close(SubmapTrigger trigger) {
  if (!open_) return std::nullopt;
  jobs_->Finish();
  Open open = std::move(*open_);
  open_.reset();

  Submap submap;
  const AnchoredPose& middle = open.track[open.track.size() / 2];
  submap.start = open.track.front().time;
  submap.end = open.track.back().time;
  submap.frame_time = middle.time;
  submap.T_map_submap = middle.T_map_vehicle;
  submap.heading_spread = HeadingSpread(open.track, LevelPose(middle.T_map_vehicle).yaw);
  submap.dvl_yaw_rad = open.sum_dvl_yaw_rad / static_cast<double>(open.track.size());
  submap.drift_per_m = DriftPerM(open);
  submap.trigger = trigger;
  submap.soundings_read = open.soundings_read;

  const PointCloud all = open.voxels.Centroids();
  const std::vector<std::uint8_t> seabed = FindSeabed(all, open.voxels.Pings(), filter_, for_each_);
  const Eigen::Isometry3d T_submap_voxels =
      middle.T_anchored_vehicle.inverse() * Eigen::Translation3d(open.voxels.p_map_origin());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (seabed[i] == 0) {
      soundings_lost_["soundings_outliers"] += static_cast<std::int64_t>(all.soundings[i]);
      continue;
    }
    submap.cloud.Add((T_submap_voxels * all.points[i].cast<double>()).cast<float>(),
                     all.soundings[i]);
    submap.soundings_used += static_cast<std::uint64_t>(all.soundings[i]);
  }
  if (submap.cloud.size() < static_cast<std::size_t>(params_.min_points)) {
    ++submaps_too_small_;
    return std::nullopt;
  }
  for (std::size_t i = 0; i < open.voxel_of_sounding.size(); ++i) {
    SubmapSoundings::Sounding& sounding = open.soundings.soundings[i];
    sounding.p_submap_m = (T_submap_voxels * sounding.p_submap_m.cast<double>()).cast<float>();
    sounding.used = open.voxel_of_sounding[i] != kNoVoxel && seabed[open.voxel_of_sounding[i]] != 0;
  }
  const Eigen::Matrix3d R_level_submap = LevelFromBody(submap.T_map_submap);
  open.soundings.R_level_submap = R_level_submap;
  const Eigen::Isometry3d T_submap_anchored = middle.T_anchored_vehicle.inverse();
  for (std::size_t i = 0; i < open.soundings.motions.size(); ++i) {
    SubmapSoundings::Motion& motion = open.soundings.motions[i];
    const Eigen::Isometry3d T_submap_vehicle = T_submap_anchored * open.track[i].T_anchored_vehicle;
    motion.p_level_m = R_level_submap * T_submap_vehicle.translation();
    motion.rpy_rad = RpyFromRotation(R_level_submap * T_submap_vehicle.linear());
  }
  soundings_ = std::move(open.soundings);
  frames_.push_back({middle.time, middle.T_map_vehicle.translation().head<2>()});
  const PointCloud level = LevelCloud(submap.cloud, LevelFromBody(submap.T_map_submap));
  const double sigma_m =
      std::sqrt(open.sum_variance_m2 / static_cast<double>(open.voxels.soundings()));
  const std::array<std::function<void()>, 2> parts{
      [&] { submap.footprint = FootprintOf(level); },
      [&] {
        submap.predicted_information =
            params_.expected_overlap * PredictInformation(level, filter_.voxel_m, sigma_m);
      }};
  for_each_(parts.size(), [&](std::size_t i) { parts[i](); });
  return submap;
}

}  // namespace seastitch
