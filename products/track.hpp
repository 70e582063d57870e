#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"
#include "products/geo_files.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Spreads the corrections of the submap frames over the whole track. At a submap frame a pose moves
// rigidly with its submap; between two frames the two rigid motions are blended with the weight
// 3 u^2 - 2 u^3 of the elapsed time u, whose slope is zero at both ends. So the corrected track is
// continuous with its first derivative, passes through every corrected frame, and turns with each
// submap there. Before the first and after the last frame it follows that submap.
class TrackCorrection {
 public:
  // One pose (and sigma) a submap of the survey; frames that share a time count once.
  TrackCorrection(const Survey& survey,
                  const SurveyPoses& poses,
                  const std::vector<std::optional<Eigen::Vector3d>>& sigmas);

  // Corrected level pose of T_map_level, which dead reckoning of that chain gave for that time.
  Pose2 operator()(Time time, const Pose2& T_map_level, std::int32_t chain = 0) const;

  // Standard deviations of x, y [m], yaw [rad], blended likewise between the solved frames. The
  // growth of dead reckoning between two frames is not included.
  std::optional<Eigen::Vector3d> Sigma(Time time, std::int32_t chain = 0) const;

 private:
  struct Frame {
    std::int32_t chain;
    Time time;
    Pose2 dead_reckoned;
    Pose2 corrected;
    std::optional<Eigen::Vector3d> sigma;
  };
  struct Between {
    const Frame* before;  // null: the chain has none
    const Frame* after;   // equal to before outside of the frames
    double weight_after;
  };
  Between Find(Time time, std::int32_t chain) const;

  MountingErrors mounting_;
  std::vector<Frame> frames_;  // by chain, then by rising time
};

struct CorrectedState {
  Time time;
  Eigen::Vector3d p_dead_reckoned = Eigen::Vector3d::Zero();  // map frame
  Eigen::Vector3d rpy_dead_reckoned_rad = Eigen::Vector3d::Zero();
  Pose2 corrected;  // z, roll and pitch stay
  std::optional<Eigen::Vector3d> sigma;
  std::int32_t chain = 0;
};

// Every state of the track, corrected; for a survey without a track (imported submaps) the submap
// frames. Without submaps the sigmas are those of NAV.
std::vector<CorrectedState> CorrectTrack(const Survey& survey, const TrackCorrection& correction);

// Horizontal length [m] and duration [s] of the dead-reckoned track, without the gaps between
// chains.
double TrackLength(const std::vector<CorrectedState>& track);
double TrackDuration(const std::vector<CorrectedState>& track);

// track.csv: one header line with units, then one line a state; degrees. With a datum (map frame
// North-East-Down) the corrected latitude and longitude end the line. Empty fields: not known.
std::string TrackCsv(const std::vector<CorrectedState>& track, const std::optional<Datum>& datum);

}  // namespace seastitch
