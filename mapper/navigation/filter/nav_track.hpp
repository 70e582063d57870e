#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/aiding/stamp_offset.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"

namespace seastitch {

// Pose of the vehicle frame and its velocity over ground at one instant; map axes: north, east,
// down.
struct TrackPose {
  Time time;
  Eigen::Vector3d p_map;
  Eigen::Vector3d v_map_mps;
  Eigen::Quaterniond q_map_vehicle;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.time, self.p_map, self.v_map_mps, self.q_map_vehicle);
  }
};

// History of the estimates at three rates, each for a bounded time: poses at the rate of the
// inertial unit (for pose_window_s), poses with covariance every epoch_interval_s, and transition
// matrices for RelativeCovariance() every key_interval_s (both for window_s). The keys in the
// configuration are pose_history_s, history_s, epoch_interval_s and key_interval_s.
class NavTrack {
 public:
  explicit NavTrack(const NavigationParams& params)
      : params_(params), longest_interval_s_(params.imu_gap_s) {}
  // Longest interval between poses that is no hole. At first it is imu_gap_s.
  void SetLongestInterval(double s) { longest_interval_s_ = s; }

  // Records the filter's state after every inertial sample, in order of time. Takes the transition
  // from the filter (TakeTransition()) where a key is due.
  void Add(Time t, ErrorStateFilter* filter, bool bottom_lock);

  std::optional<Time> latest() const;
  std::optional<NavState> StateAt(Time t) const;
  // See Navigation. A gap of up to 2 s is bridged by states.
  Time AfterGap(Time t) const;
  std::optional<Eigen::Matrix2d> VelocityCovariance(Time t) const;
  // dvl_stamps: estimated delay of the DVL stamps, or null. Its effect on both poses is added, also
  // for times before the delay was found.
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a,
                                                    Time b,
                                                    const StampOffset* dvl_stamps = nullptr) const;
  std::optional<Pose2> Hindsight(Time anchor, Time t) const;
  std::vector<SmoothedPose> TakeSmoothed(Time until);

  // For a restart: the newest state, and the poses at `instants` with what RelativeCovariance()
  // needs for them.
  struct Memory;
  std::optional<Memory> Remember(std::vector<Time> instants) const;
  // Call on an empty track. Of the time before the newest pose, only the instants are known then.
  void Restore(const Memory& memory);

 private:
  // Record of every epoch_interval_s.
  struct Epoch {
    Time time;
    Eigen::Matrix<float, 6, 6> covariance;  // of x, y, z [m], roll, pitch, yaw [rad], for NavState
    bool bottom_lock;
    Eigen::Matrix<float, kErrorSize, 1> adjoint;  // Transition::adjoint since the last key

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.covariance, self.bottom_lock, self.adjoint);
    }
  };
  // x, y, yaw and horizontal velocity: enough to carry the error from the key to a time near it.
  static constexpr int kKeyRows = 5;
  using KeyVector = Eigen::Matrix<double, kKeyRows, 1>;
  struct Key {
    Time time;
    Pose2 level;  // T_map_level; a key is recorded every key_interval_s
    Eigen::Vector2d v_map_mps;
    Eigen::Matrix<double, kKeyRows, kErrorSize> J;   // level pose and velocity by error state
    Eigen::Matrix<double, kErrorSize, kKeyRows> PJ;  // covariance times J transposed
    ErrorStateFilter::Transition from_last;          // from the key before
    // ErrorStateFilter::HeadingDoubt, projected by J; its covariance is part of PJ.
    int doubt;
    KeyVector by_doubt;
    // ErrorStateFilter::StampError, projected by J.
    KeyVector by_delay;
    KeyVector by_carrying;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.level, self.v_map_mps, self.J, self.PJ, self.from_last);
      archive(self.doubt, self.by_doubt, self.by_delay, self.by_carrying);
    }
  };

  void AddEpoch(const TrackPose& pose,
                const Eigen::Matrix<double, 8, kErrorSize>& J,
                const ErrorMatrix& P,
                const ErrorVector& adjoint,
                bool bottom_lock);
  void AddKey(const TrackPose& pose,
              const Eigen::Matrix<double, 8, kErrorSize>& J,
              ErrorStateFilter* filter);
  std::optional<TrackPose> PoseAt(Time t) const;
  struct Instant;
  const Instant* Remembered(Time t) const;
  bool IsForgotten(Time t) const;
  struct Hole {
    Time from;
    Time to;
  };
  std::optional<Hole> HoleAt(Time t) const;     // strictly inside
  std::optional<Time> HoleBegan(Time t) const;  // that t lies in
  Matrix6d CovarianceAt(Time t) const;
  const Epoch& EpochAt(Time t) const;
  // Inside a hole the key before it.
  std::optional<std::size_t> NearestKey(Time t) const;
  // Covariances of x, y, yaw of two poses a and b, and their cross-covariance.
  struct PairCovariance {
    Eigen::Matrix3d a;
    Eigen::Matrix3d b;
    Eigen::Matrix3d a_b;
    // Adds a common error of that variance, with these effects on a and on b.
    void Add(const Eigen::Vector3d& of_a, const Eigen::Vector3d& of_b, double variance);
  };
  // Adds what the vehicle may have moved in a hole until a, and until b.
  void AddHoles(Time a, Time b, PairCovariance* covariance) const;
  Pose2 LevelAt(const Key& key, Time t) const;

  // Cross-covariance of the error state at key `last` with the pose and velocity at key `first`.
  struct Carried {
    Time first;
    Time last;
    Eigen::Matrix<double, kErrorSize, kKeyRows> value;
  };
  const Carried& Carry(std::size_t first, std::size_t last) const;
  // Correction of x, y, yaw at key `first` by the measurements up to key `last`, and the covariance
  // of that pose with the error state at `last`.
  struct Smoothed {
    Time first;
    Time last;
    Eigen::Matrix<double, 3, kErrorSize> anchor_by_error;
    Eigen::Vector3d correction;
  };
  const Smoothed& Smooth(std::size_t first, std::size_t last) const;

  const NavigationParams params_;
  double longest_interval_s_;     // of poses that are no hole
  std::deque<TrackPose> poses_;   // for pose_window_s
  std::deque<TrackPose> coarse_;  // for window_s, at the times of epochs_
  std::deque<Epoch> epochs_;
  std::deque<Key> keys_;
  // Last results of Carry() for as many `first`, the one used last in front: the corrected vehicle
  // and the open submap take turns, and each continues to a later `last`.
  static constexpr std::size_t kMostCarried = 4;
  mutable std::vector<Carried> carried_;
  // Last results of Smooth() for as many anchors: that of the corrected vehicle and that of the
  // open submap take turns. The oldest is replaced.
  static constexpr std::size_t kSmoothed = 4;
  mutable std::deque<Smoothed> smoothed_;

  std::optional<SmoothedPose> taken_;  // the last of TakeSmoothed()

  // After a restart, the only poses known before resumed_at_.
  struct Instant {
    TrackPose pose;
    Epoch epoch;
    std::optional<Time> hole_began;  // HoleBegan()

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.pose, self.epoch, self.hole_began);
    }
  };
  std::vector<Instant> instants_;
  std::optional<Time> resumed_at_;
};

struct NavTrack::Memory {
  std::vector<Instant> instants;
  std::vector<Key> keys;  // before and after each instant, and the newest, with joined transitions
  TrackPose newest;
  TrackPose coarse;  // at the newest epoch
  Epoch epoch;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.instants, self.keys, self.newest, self.coarse, self.epoch);
  }
};

}  // namespace seastitch
