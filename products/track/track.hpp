#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"
#include "common/geo/datum.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Sets TrackState::smoothed of one dive. poses: in order of time. Between two of them the position
// is cubic with the velocities at both ends, since the given one may step, and the correction of
// the yaw is linear. Before the first and after the last, the state moves rigidly with that one.
void Smooth(const std::vector<SmoothedPose>& poses,
            std::int32_t chain,
            std::vector<TrackState>* track);

// Interpolates the corrections of the submap frames over the whole track.
//
// Each corrected submap defines a rigid motion of the track as navigation smoothed it
// (TrackState::smoothed). At the time of a submap's frame the track is moved by that submap's
// motion. Between the times of two frames both motions are blended: the later one has the weight 3
// u^2 - 2 u^3, where u, 0 to 1, is the elapsed part of the time between them. The weight's slope is
// zero at both ends. So the corrected track and its velocity are continuous, and the track passes
// through every corrected frame with that submap's correction of yaw. Before the first and after
// the last frame of a dive the motion of that submap applies.
class TrackCorrection {
 public:
  // poses, sigmas: one per submap of the survey. Of frames of one dive with the same time, the
  // first counts.
  TrackCorrection(const Survey& survey,
                  const SurveyPoses& poses,
                  const std::vector<std::optional<Eigen::Vector3d>>& sigmas);

  // Corrects a smoothed pose of the vehicle (x, y, yaw in the map) at this time of this dive.
  // The result is the vehicle's pose: the estimated offset of the sonar is taken out of the frames'
  // corrections.
  Pose2 operator()(Time time, const Pose2& T_map_level, std::int32_t chain = 0) const;

  // Standard deviations of x, y [m], yaw [rad], interpolated with the same weights between those of
  // the solved frames. The growth of dead reckoning's uncertainty between two frames is not
  // included. Absent where a frame has none.
  std::optional<Eigen::Vector3d> Sigma(Time time, std::int32_t chain = 0) const;

 private:
  struct Frame {
    std::int32_t chain;
    Time time;
    Pose2 smoothed;
    Pose2 corrected;
    std::optional<Eigen::Vector3d> sigma;
    MountingErrors mounting;
  };
  struct Between {
    const Frame* before;  // null: the chain has none
    const Frame* after;   // equal to before outside of the frames
    double weight_after;
  };
  Between Find(Time time, std::int32_t chain) const;

  std::vector<Frame> frames_;  // by chain, then by rising time
};

// State of the vehicle's reference point at one time, before and after the correction, map frame.
struct CorrectedState {
  Time time;
  Eigen::Vector3d p_dead_reckoned = Eigen::Vector3d::Zero();        // [m]
  Eigen::Vector3d rpy_dead_reckoned_rad = Eigen::Vector3d::Zero();  // roll, pitch, yaw
  Pose2 corrected;                       // x, y, yaw; z, roll and pitch stay as dead reckoned
  std::optional<Eigen::Vector3d> sigma;  // 1 sigma of x, y [m], yaw [rad]
  std::int32_t chain = 0;
};

// Corrects every state of the track. A survey without a track (imported submaps) gives its submap
// frames instead. A survey without submaps keeps the sigmas of NAV.
std::vector<CorrectedState> CorrectTrack(const Survey& survey, const TrackCorrection& correction);

// The track of each dive, by the time of its first state.
std::vector<std::vector<CorrectedState>> TracksOfDives(const std::vector<CorrectedState>& track);

// Horizontal length [m] and duration [s] of the dead-reckoned track, without the gaps between
// chains.
double TrackLength(const std::vector<CorrectedState>& track);
double TrackDuration(const std::vector<CorrectedState>& track);

// Text of track.csv: one header line with names and units, then one line per state; angles in
// degrees. With a datum (map frame North-East-Down) the last two columns are the corrected latitude
// and longitude. An empty field is not known.
std::string TrackCsv(const std::vector<CorrectedState>& track, const std::optional<Datum>& datum);

}  // namespace seastitch
