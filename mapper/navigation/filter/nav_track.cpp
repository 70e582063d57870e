#include "mapper/navigation/filter/nav_track.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "common/core/time_series.hpp"

namespace seastitch {
namespace {

constexpr double kBridgedByStatesS = 2.0;

template <class T>
void DropBefore(Time oldest, std::deque<T>* items) {
  // Keeps one older item, so that the window's first instant can be interpolated.
  while (items->size() > 2 && (*items)[1].time <= oldest) items->pop_front();
}

// Index of the last item at or before t.
template <class T>
std::optional<std::size_t> LastAtOrBefore(Time t, const std::deque<T>& items) {
  if (items.empty() || t < items.front().time || t > items.back().time) return std::nullopt;
  return static_cast<std::size_t>(FirstAfter(items, t) - items.begin()) - 1;
}

// Position cubic with the velocities at both ends, attitude by the shortest rotation.
TrackPose Between(const TrackPose& a, const TrackPose& b, Time t) {
  const double dt = ToSeconds(b.time - a.time);
  const double w = ToSeconds(t - a.time) / dt;
  const double w2 = w * w;
  const double w3 = w2 * w;
  TrackPose at;
  at.time = t;
  at.p_map = (2.0 * w3 - 3.0 * w2 + 1.0) * a.p_map + (w3 - 2.0 * w2 + w) * dt * a.v_map_mps +
             (3.0 * w2 - 2.0 * w3) * b.p_map + (w3 - w2) * dt * b.v_map_mps;
  at.v_map_mps = (1.0 - w) * a.v_map_mps + w * b.v_map_mps;
  at.q_map_vehicle = a.q_map_vehicle.slerp(w, b.q_map_vehicle);
  return at;
}

std::optional<TrackPose> Interpolate(Time t, const std::deque<TrackPose>& poses) {
  const auto i = LastAtOrBefore(t, poses);
  if (!i) return std::nullopt;
  if (poses[*i].time == t) return poses[*i];
  return Between(poses[*i], poses[*i + 1], t);
}

// The times of the poses around t, if they are more than longest_s apart.
std::optional<std::pair<Time, Time>> GapAround(Time t,
                                               const std::deque<TrackPose>& poses,
                                               double longest_s) {
  const auto i = LastAtOrBefore(t, poses);
  if (!i || *i + 1 >= poses.size() || poses[*i].time == t) return std::nullopt;
  const Time from = poses[*i].time;
  const Time to = poses[*i + 1].time;
  if (ToSeconds(to - from) <= longest_s) return std::nullopt;
  return std::pair(from, to);
}

// Sigma of an unmeasured rotation over dt_s [rad].
double CoastTurn(double dt_s) { return std::min(kCoastTurnRadps * dt_s, kPi / 2.0); }

Pose2 Moved(const Pose2& pose, const Eigen::Vector3d& by) {
  return {pose.x + by.x(), pose.y + by.y(), WrapAngle(pose.yaw + by.z())};
}

// Transition over `first` and then `second`.
ErrorStateFilter::Transition Then(const ErrorStateFilter::Transition& first,
                                  const ErrorStateFilter::Transition& second) {
  return {second.A * first.A, first.adjoint + first.A.transpose() * second.adjoint};
}

}  // namespace

void NavTrack::Add(Time t, ErrorStateFilter* filter, bool bottom_lock) {
  const Eigen::Isometry3d T = filter->T_map_vehicle();
  const TrackPose pose{
      t, T.translation(), filter->v_map_vehicle_mps(), Eigen::Quaterniond(T.linear())};
  poses_.push_back(pose);
  DropBefore(t - FromSeconds(params_.pose_window_s), &poses_);

  const bool epoch =
      epochs_.empty() || ToSeconds(t - epochs_.back().time) >= params_.epoch_interval_s - 1e-6;
  const bool key =
      keys_.empty() || ToSeconds(t - keys_.back().time) >= params_.key_interval_s - 1e-6;
  if (!epoch && !key) return;
  const Eigen::Matrix<double, 8, kErrorSize> J = filter->VehicleJacobian();
  const ErrorMatrix& P = filter->covariance();
  if (key) AddKey(pose, J, filter);
  if (epoch) AddEpoch(pose, J, P, filter->adjoint(), bottom_lock);
}

void NavTrack::AddEpoch(const TrackPose& pose,
                        const Eigen::Matrix<double, 8, kErrorSize>& J,
                        const ErrorMatrix& P,
                        const ErrorVector& adjoint,
                        bool bottom_lock) {
  const Eigen::Matrix<double, 6, 6> covariance = J.topRows<6>() * P * J.topRows<6>().transpose();
  epochs_.push_back({pose.time, covariance.cast<float>(), bottom_lock, adjoint.cast<float>()});
  coarse_.push_back(pose);
  const Time oldest = pose.time - FromSeconds(params_.window_s);
  DropBefore(oldest, &epochs_);
  DropBefore(oldest, &coarse_);
}

void NavTrack::AddKey(const TrackPose& pose,
                      const Eigen::Matrix<double, 8, kErrorSize>& J,
                      ErrorStateFilter* filter) {
  Key key;
  key.time = pose.time;
  key.level = LevelPose(MakePose(pose.p_map, pose.q_map_vehicle.toRotationMatrix()));
  key.v_map_mps = pose.v_map_mps.head<2>();
  key.J.topRows<2>() = J.topRows<2>();
  key.J.bottomRows<3>() = J.bottomRows<3>();  // yaw, v north, v east
  key.PJ = filter->covariance() * key.J.transpose();
  key.from_last = filter->TakeTransition();
  const ErrorStateFilter::HeadingDoubt doubt = filter->heading_doubt();
  key.doubt = doubt.number;
  key.by_doubt = key.J * doubt.error;
  key.by_delay = key.J * filter->stamp_error().by_delay;
  key.by_carrying = key.J * filter->stamp_error().by_carrying;
  keys_.push_back(key);
  DropBefore(pose.time - FromSeconds(params_.window_s), &keys_);
}

std::optional<Time> NavTrack::latest() const {
  if (poses_.empty()) return std::nullopt;
  return poses_.back().time;
}

std::optional<NavTrack::Memory> NavTrack::Remember(std::vector<Time> instants) const {
  if (poses_.empty()) return std::nullopt;
  Memory memory;
  memory.newest = poses_.back();
  memory.coarse = coarse_.back();
  memory.epoch = epochs_.back();
  std::vector<bool> kept(keys_.size(), false);
  kept.back() = true;
  for (const Time t : instants) {
    const std::optional<TrackPose> pose = PoseAt(t);
    if (!pose || t < keys_.front().time) continue;
    memory.instants.push_back({*pose, EpochAt(t), HoleBegan(t)});
    memory.instants.back().epoch.covariance = CovarianceAt(t).cast<float>();
    const std::size_t key = LastAtOrBefore(t, keys_).value_or(keys_.size() - 1);
    kept[key] = true;
    if (key + 1 < keys_.size()) kept[key + 1] = true;
  }
  // From the last key that was kept.
  std::optional<ErrorStateFilter::Transition> way;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (memory.keys.empty() && !kept[i]) continue;
    way = way ? Then(*way, keys_[i].from_last) : keys_[i].from_last;
    if (!kept[i]) continue;
    memory.keys.push_back(keys_[i]);
    memory.keys.back().from_last = *std::exchange(way, std::nullopt);
  }
  return memory;
}

void NavTrack::Restore(const Memory& memory) {
  instants_ = memory.instants;
  resumed_at_ = memory.newest.time;
  poses_ = {memory.newest};
  coarse_ = {memory.coarse};
  epochs_ = {memory.epoch};
  keys_.assign(memory.keys.begin(), memory.keys.end());
  carried_.clear();
  smoothed_.clear();
  taken_.reset();
}

const NavTrack::Instant* NavTrack::Remembered(Time t) const {
  const auto found = std::find_if(
      instants_.begin(), instants_.end(), [t](const Instant& i) { return i.pose.time == t; });
  return found == instants_.end() ? nullptr : &*found;
}

bool NavTrack::IsForgotten(Time t) const {
  return resumed_at_ && t < *resumed_at_ && Remembered(t) == nullptr;
}

const NavTrack::Epoch& NavTrack::EpochAt(Time t) const {
  if (const Instant* const instant = Remembered(t)) return instant->epoch;
  return epochs_[LastAtOrBefore(t, epochs_).value_or(epochs_.size() - 1)];
}

std::optional<TrackPose> NavTrack::PoseAt(Time t) const {
  if (const Instant* const instant = Remembered(t)) return instant->pose;
  if (IsForgotten(t)) return std::nullopt;
  if (const auto pose = Interpolate(t, poses_)) return pose;
  return Interpolate(t, coarse_);
}

// Among coarse poses only gaps that are longer by their interval can be detected.
std::optional<NavTrack::Hole> NavTrack::HoleAt(Time t) const {
  const bool fine = !poses_.empty() && t >= poses_.front().time;
  const double longest_s = longest_interval_s_ + (fine ? 0.0 : params_.epoch_interval_s);
  const auto gap = GapAround(t, fine ? poses_ : coarse_, longest_s);
  if (!gap || IsForgotten(t)) return std::nullopt;
  return Hole{gap->first, gap->second};
}

std::optional<Time> NavTrack::HoleBegan(Time t) const {
  if (const Instant* const instant = Remembered(t)) return instant->hole_began;
  const std::optional<Hole> hole = HoleAt(t);
  return hole ? std::optional(hole->from) : std::nullopt;
}

// Inside a gap the position's variance grows linearly from one end to the other. Roll, pitch and
// yaw may have changed and come back.
Matrix6d NavTrack::CovarianceAt(Time t) const {
  Matrix6d covariance = EpochAt(t).covariance.cast<double>();
  const std::optional<Hole> hole = Remembered(t) ? std::nullopt : HoleAt(t);
  if (!hole) return covariance;
  const double w = ToSeconds(t - hole->from) / ToSeconds(hole->to - hole->from);
  covariance = (1.0 - w) * covariance + w * EpochAt(hole->to).covariance.cast<double>();
  const double turned_rad = CoastTurn(ToSeconds(std::min(t - hole->from, hole->to - t)));
  const double tilted_rad = std::min(turned_rad, kCoastTilt);
  covariance.diagonal().segment<2>(3).array() += tilted_rad * tilted_rad;
  covariance(5, 5) += turned_rad * turned_rad;
  return covariance;
}

Time NavTrack::AfterGap(Time t) const {
  if (const std::optional<Hole> hole = HoleAt(t))
    return ToSeconds(hole->to - hole->from) > kBridgedByStatesS ? hole->to : t;
  if (poses_.empty()) return t;
  const Time oldest =
      coarse_.empty() ? poses_.front().time : std::min(poses_.front().time, coarse_.front().time);
  return std::max(t, oldest);
}

std::optional<NavState> NavTrack::StateAt(Time t) const {
  const auto pose = PoseAt(t);
  if (!pose) return std::nullopt;
  NavState state;
  state.time = t;
  state.T_map_vehicle = MakePose(pose->p_map, pose->q_map_vehicle.toRotationMatrix());
  state.v_map_mps = pose->v_map_mps;
  state.covariance = CovarianceAt(t);
  state.bottom_lock = EpochAt(t).bottom_lock;
  return state;
}

std::optional<std::size_t> NavTrack::NearestKey(Time t) const {
  if (keys_.empty() || t < keys_.front().time || t > *latest() || IsForgotten(t))
    return std::nullopt;
  const std::size_t i = LastAtOrBefore(t, keys_).value_or(keys_.size() - 1);
  if (HoleBegan(t)) return i;
  const bool next_is_nearer = i + 1 < keys_.size() && keys_[i + 1].time - t < t - keys_[i].time;
  return next_is_nearer ? i + 1 : i;
}

Pose2 NavTrack::LevelAt(const Key& key, Time t) const {
  if (const auto pose = PoseAt(t))
    return LevelPose(MakePose(pose->p_map, pose->q_map_vehicle.toRotationMatrix()));
  const Eigen::Vector2d p = key.level.Translation() + ToSeconds(t - key.time) * key.v_map_mps;
  return {p.x(), p.y(), key.level.yaw};
}

std::optional<Eigen::Matrix2d> NavTrack::VelocityCovariance(Time t) const {
  const auto key = NearestKey(t);
  if (!key) return std::nullopt;
  return keys_[*key].J.bottomRows<2>() * keys_[*key].PJ.rightCols<2>();
}

// A(first to last) P(first) J_first^T, always multiplied from the right, so that the bits do not
// depend on whether an earlier call computed a part.
const NavTrack::Carried& NavTrack::Carry(std::size_t first, std::size_t last) const {
  const auto goes_on = std::find_if(carried_.begin(), carried_.end(), [&](const Carried& carried) {
    return carried.first == keys_[first].time && carried.last <= keys_[last].time;
  });
  if (goes_on != carried_.end()) {
    std::rotate(carried_.begin(), goes_on, goes_on + 1);
  } else {
    if (carried_.size() == kMostCarried) carried_.pop_back();
    carried_.insert(carried_.begin(), {keys_[first].time, keys_[first].time, keys_[first].PJ});
  }
  Carried& carried = carried_.front();
  const auto done = LastAtOrBefore(carried.last, keys_);
  for (std::size_t i = *done + 1; i <= last; ++i)
    carried.value = (keys_[i].from_last.A * carried.value).eval();
  carried.last = keys_[last].time;
  return carried;
}

void NavTrack::PairCovariance::Add(const Eigen::Vector3d& of_a,
                                   const Eigen::Vector3d& of_b,
                                   double variance) {
  a += variance * of_a * of_a.transpose();
  b += variance * of_b * of_b.transpose();
  a_b += variance * of_a * of_b.transpose();
}

// Adds the uncertainty inside gaps: a velocity error of coast_speed_sigma_mps and an unmeasured
// rotation. Two instants in one gap share the error up to the earlier one.
void NavTrack::AddHoles(Time a, Time b, PairCovariance* covariance) const {
  const auto variance = [this](double dt_s) {
    const double moved_m = params_.coast_speed_sigma_mps * dt_s;
    const double turned_rad = CoastTurn(dt_s);
    return Eigen::Vector3d(moved_m * moved_m, moved_m * moved_m, turned_rad * turned_rad);
  };
  const std::optional<Time> before_a = HoleBegan(a);
  const std::optional<Time> before_b = HoleBegan(b);
  if (before_a && before_a == before_b) {
    covariance->b.diagonal() += variance(std::abs(ToSeconds(b - a)));
    return;
  }
  if (before_a) covariance->a.diagonal() += variance(ToSeconds(a - *before_a));
  if (before_b) covariance->b.diagonal() += variance(ToSeconds(b - *before_b));
}

std::optional<Eigen::Matrix3d> NavTrack::RelativeCovariance(Time a,
                                                            Time b,
                                                            const StampOffset* dvl_stamps) const {
  const auto key_a = NearestKey(a);
  const auto key_b = NearestKey(b);
  if (!key_a || !key_b) return std::nullopt;
  const std::size_t first = std::min(*key_a, *key_b);
  const std::size_t last = std::max(*key_a, *key_b);
  const Eigen::Matrix<double, kKeyRows, kKeyRows> last_by_first =
      keys_[last].J * Carry(first, last).value;

  // Within the half second to its key, the error of a pose changes with the velocity error.
  const auto carry = [](const Key& key, Time t) {
    Eigen::Matrix<double, 3, kKeyRows> E = Eigen::Matrix<double, 3, kKeyRows>::Zero();
    E.leftCols<3>().setIdentity();
    E.topRightCorner<2, 2>().diagonal().setConstant(ToSeconds(t - key.time));
    return E;
  };
  const Key& at_a = keys_[*key_a];
  const Key& at_b = keys_[*key_b];
  const auto Ea = carry(at_a, a);
  const auto Eb = carry(at_b, b);
  Eigen::Matrix<double, kKeyRows, kKeyRows> a_by_b = last_by_first;
  if (*key_a == first) a_by_b.transposeInPlace();
  PairCovariance covariance{Ea * at_a.J * at_a.PJ * Ea.transpose(),
                            Eb * at_b.J * at_b.PJ * Eb.transpose(),
                            Ea * a_by_b * Eb.transpose()};
  if (dvl_stamps) {
    const double delay_s = dvl_stamps->delay_s();
    const double variance_s2 = dvl_stamps->sigma_s() * dvl_stamps->sigma_s();
    covariance.Add(Ea * (delay_s * at_a.by_delay - at_a.by_carrying),
                   Eb * (delay_s * at_b.by_delay - at_b.by_carrying),
                   1.0);
    covariance.Add(Ea * at_a.by_delay, Eb * at_b.by_delay, variance_s2);
  }
  AddHoles(a, b, &covariance);
  // The two hypotheses of the heading are too far apart for a linear model.
  const Eigen::Vector3d doubt_a = Ea * at_a.by_doubt;
  const Eigen::Vector3d doubt_b = Eb * at_b.by_doubt;
  covariance.a -= doubt_a * doubt_a.transpose();
  covariance.b -= doubt_b * doubt_b.transpose();
  if (at_a.doubt == at_b.doubt) covariance.a_b -= doubt_a * doubt_b.transpose();
  const Pose2 level_a = LevelAt(at_a, a);
  const Pose2 level_b = LevelAt(at_b, b);
  const Pose2 own = Inverse(level_a) * level_b;
  const Pose2 other = Inverse(Moved(level_a, doubt_a)) * Moved(level_b, doubt_b);
  Eigen::Vector3d off = other.Vector() - own.Vector();
  off.z() = WrapAngle(off.z());
  Eigen::Matrix3d relative =
      seastitch::RelativeCovariance(level_a, level_b, covariance.a, covariance.b, covariance.a_b);
  // A gap of days makes it a small difference of very large numbers, which is known to so many
  // digits.
  constexpr double kVeryLarge_m2 = 1e8, kLostShare = 1e-11;
  const double largest_m2 = std::max(covariance.a.topLeftCorner<2, 2>().trace(),
                                     covariance.b.topLeftCorner<2, 2>().trace());
  if (largest_m2 > kVeryLarge_m2) relative.diagonal().head<2>().array() += kLostShare * largest_m2;
  return 0.5 * (relative + relative.transpose()) + off * off.transpose();
}

// Summed from the anchor on, always in the same order, so that the bits do not depend on whether an
// earlier call computed a part.
const NavTrack::Smoothed& NavTrack::Smooth(std::size_t first, std::size_t last) const {
  auto found = std::find_if(smoothed_.begin(), smoothed_.end(), [&](const Smoothed& s) {
    return s.first == keys_[first].time && s.last <= keys_[last].time;
  });
  if (found == smoothed_.end()) {
    if (smoothed_.size() >= kSmoothed) smoothed_.pop_front();
    smoothed_.push_back({keys_[first].time,
                         keys_[first].time,
                         keys_[first].PJ.leftCols<3>().transpose(),
                         Eigen::Vector3d::Zero()});
    found = std::prev(smoothed_.end());
  }
  const auto done = LastAtOrBefore(found->last, keys_);
  for (std::size_t i = *done + 1; i <= last; ++i) {
    found->correction += found->anchor_by_error * keys_[i].from_last.adjoint;
    found->anchor_by_error = (found->anchor_by_error * keys_[i].from_last.A.transpose()).eval();
  }
  found->last = keys_[last].time;
  return *found;
}

// Later measurements also correct the anchor's own pose: a compass error of half a degree that
// shows now was probably there before.
std::optional<Pose2> NavTrack::Hindsight(Time anchor, Time t) const {
  if (keys_.empty() || anchor < keys_.front().time || t < anchor || t < epochs_.front().time ||
      t > *latest() || IsForgotten(anchor))
    return std::nullopt;
  const std::size_t first = LastAtOrBefore(anchor, keys_).value_or(keys_.size() - 1);
  const Epoch& now = epochs_[LastAtOrBefore(t, epochs_).value_or(epochs_.size() - 1)];
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();
  if (now.time >= keys_[first].time) {
    const Smoothed& smoothed =
        Smooth(first, LastAtOrBefore(now.time, keys_).value_or(keys_.size() - 1));
    correction = smoothed.correction + smoothed.anchor_by_error * now.adjoint.cast<double>();
  }
  const Pose2& frozen = keys_[first].level;
  const Pose2 known_at_t{
      frozen.x + correction.x(), frozen.y + correction.y(), WrapAngle(frozen.yaw + correction.z())};
  return frozen * Inverse(known_at_t);
}

std::vector<SmoothedPose> NavTrack::TakeSmoothed(Time until) {
  if (keys_.empty()) return {};
  const std::size_t first = taken_ ? LastAtOrBefore(taken_->time, keys_).value_or(0) : 0;
  const Epoch& now = epochs_.back();
  ErrorVector adjoint = ErrorVector::Zero();  // of the measurements after a key
  if (now.time >= keys_.back().time) adjoint = now.adjoint.cast<double>();
  std::vector<SmoothedPose> smoothed;
  for (std::size_t i = keys_.size(); i-- > first;) {
    const Key& key = keys_[i];
    const KeyVector correction = key.PJ.transpose() * adjoint;
    smoothed.push_back({key.time,
                        key.level,
                        Moved(key.level, correction.head<3>()),
                        key.v_map_mps + correction.tail<2>()});
    adjoint = (key.from_last.adjoint + key.from_last.A.transpose() * adjoint).eval();
  }
  std::reverse(smoothed.begin(), smoothed.end());
  // Since then it is known better where the last one was.
  if (taken_ && taken_->time == smoothed.front().time) {
    const Pose2 T_taken_now = taken_->smoothed * Inverse(smoothed.front().smoothed);
    for (SmoothedPose& pose : smoothed) {
      pose.smoothed = T_taken_now * pose.smoothed;
      pose.v_map_mps = T_taken_now.Rotation() * pose.v_map_mps;
    }
    smoothed.erase(smoothed.begin());
  }
  std::erase_if(smoothed, [until](const SmoothedPose& pose) { return pose.time > until; });
  if (!smoothed.empty()) taken_ = smoothed.back();
  return smoothed;
}

}  // namespace seastitch
