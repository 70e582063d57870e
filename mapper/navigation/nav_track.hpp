#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <deque>
#include <optional>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/error_state_filter.hpp"

namespace seastitch {

// The vehicle frame at one instant.
struct TrackPose {
  Time time;
  Eigen::Vector3d p_map;
  Eigen::Vector3d v_map_mps;
  Eigen::Quaterniond q_map_vehicle;
};

// What was concluded, kept for a bounded time in three grains: poses at the rate of the inertial
// unit, poses with covariance ten times a second, and once a second what RelativeCovariance needs.
class NavTrack {
 public:
  explicit NavTrack(const NavigationParams& params) : params_(params) {}

  // After every inertial sample, in order of time.
  void Add(Time t, ErrorStateFilter* filter, bool bottom_lock);

  std::optional<Time> latest() const;
  std::optional<NavState> StateAt(Time t) const;
  std::optional<Eigen::Matrix2d> VelocityCovariance(Time t) const;
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const;
  std::optional<Pose2> Hindsight(Time anchor, Time t) const;

 private:
  struct Epoch {
    Time time;
    Eigen::Matrix<float, 6, 6> covariance;  // for publication: 7 digits of it are enough
    bool bottom_lock;
    Eigen::Matrix<float, kErrorSize, 1> news;  // since the key at or before
  };
  // x, y, yaw and horizontal velocity: enough to carry the error from the key to a time near it.
  static constexpr int kKeyRows = 5;
  struct Key {
    Time time;
    Pose2 level;
    Eigen::Vector2d v_map_mps;
    Eigen::Matrix<double, kKeyRows, kErrorSize> J;   // level pose and velocity by error state
    Eigen::Matrix<double, kErrorSize, kKeyRows> PJ;  // covariance times J transposed
    ErrorStateFilter::Transition from_last;          // from the key before
  };

  void AddEpoch(const TrackPose& pose,
                const Eigen::Matrix<double, 8, kErrorSize>& J,
                const ErrorMatrix& P,
                const ErrorVector& news,
                bool bottom_lock);
  void AddKey(const TrackPose& pose,
              const Eigen::Matrix<double, 8, kErrorSize>& J,
              const ErrorMatrix& P,
              const ErrorStateFilter::Transition& from_last);
  std::optional<TrackPose> PoseAt(Time t) const;
  std::optional<std::size_t> NearestKey(Time t) const;
  Pose2 LevelAt(const Key& key, Time t) const;

  NavigationParams params_;
  std::deque<TrackPose> poses_;   // of pose_window_s
  std::deque<TrackPose> coarse_;  // of window_s, at the times of epochs_
  std::deque<Epoch> epochs_;
  std::deque<Key> keys_;
};

}  // namespace seastitch
