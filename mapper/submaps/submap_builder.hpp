#pragma once

#include <bitset>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/placed_soundings.hpp"
#include "common/core/pose.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/submaps/cloud_filter.hpp"
#include "mapper/submaps/terrain_information.hpp"
#include "mapper/submaps/voxel_grid.hpp"

namespace seastitch {

struct SubmapParams {
  // Length along the track. Shorter submaps overlap too little for a sure closure; dead reckoning
  // bends longer ones.
  double min_length_m = 30.0;
  double max_length_m = 100.0;
  // Of a vehicle that hovers: twice this must fit the window of the navigation's covariances.
  double max_duration_s = 900.0;
  // Largest drift of dead reckoning from a submap's first ping to its last, 1 sigma in the worst
  // direction. With bottom lock that takes more than max_length_m, without it some seconds.
  double max_drift_m = 0.5;
  // Bounds memory and work whatever the sonar sends.
  int max_soundings = 5'000'000;
  // Fewer points after the filter are no submap.
  int min_points = 50;

  // Fraction of a submap that another may overlap. A submap closes when a registration of this
  // fraction would locate it better than dead reckoning does, seen from the nearest submap of an
  // earlier line.
  double expected_overlap = 0.25;
  // Of a sounding: noise, where the sonar states none or less, and relief finer than a cell.
  double sounding_sigma_m = 0.05;

  // The line ends where the heading leaves that of the submap's first ping by turn_rad for longer
  // than turn_sustain_m of track, or over a gap; the next begins where it has settled for
  // turn_settle_m, or after the gap.
  double turn_rad = Deg2Rad(25.0);
  double turn_sustain_m = 4.0;
  double turn_settle_m = 8.0;
  // A turn's swath fans out and its soundings bend with every heading error; it still ties lines
  // together.
  bool keep_turns = true;

  // Without pings for so long, or with a jump so far, what follows is another piece of seabed.
  double max_gap_s = 5.0;
  double max_gap_m = 10.0;
};

// Cuts the stream of geo-referenced pings into submaps (III-A-2): where they hold enough structure
// to be registered, where they get too long, where the line ends and where the data break off. No
// sounding is in two of them. Pure.
class SubmapBuilder {
 public:
  // Drift of dead reckoning between two pings: covariance of (x, y [m], yaw [rad]) of the vehicle
  // at `b` relative to the vehicle at `a`, level axes of `a`. Absent where it is unknown and may be
  // anything.
  using Drift = std::function<std::optional<Eigen::Matrix3d>(Time a, Time b)>;

  // T_anchored_map, level: takes the map as dead reckoning has it at `t` to a map in which the pose
  // of the vehicle at `anchor` is unchanged, so that corrections of heading or position do not bend
  // a submap (Navigation::Hindsight).
  using Hindsight = std::function<Pose2(Time anchor, Time t)>;

  SubmapBuilder(const SubmapParams& params,
                const CloudFilterParams& filter,
                Drift drift,
                Hindsight hindsight);

  // Adds a ping and gives the submap that it closed, if it closed one. A gap or a turn closes the
  // submap before the ping. Pings of several heads may have one time. Left to the caller: id,
  // covariance_from_previous, heading_sigma_rad.
  std::optional<Submap> Add(const GeoreferencedPing& ping);
  // Closes what is open.
  std::optional<Submap> Finish();

  // Keeps every sounding from now on: some 20 bytes each, of the open submap and the last.
  void KeepSoundings() { keeps_soundings_ = true; }
  // Of the submap closed last; each once. Without its id.
  SubmapSoundings TakeSoundings() { return std::exchange(soundings_, {}); }

  // Frame of the open submap, if it were closed now.
  std::optional<Time> frame_time() const;

  // Everything left out, by name, such as "soundings_too_far" or "pings_in_turns".
  const std::map<std::string, std::int64_t>& counters() const { return counters_; }

  // For a restart. Not saved: open_, soundings_, keeps_soundings_; what the next ping begins anew:
  // last_, heads_, turning_, headings_; counters_, which are of one process.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.along_m_, self.first_yaw_rad_, self.frames_, self.on_earlier_lines_);
  }

 private:
  struct Pose {
    Time time;
    Eigen::Isometry3d T_map_vehicle;
  };
  struct AnchoredPose : Pose {
    Eigen::Isometry3d T_anchored_vehicle;  // in the map anchored at the submap's first ping
  };
  // One submap that grows.
  struct Open {
    Open(const GeoreferencedPing& first, const CloudFilterParams& filter, double cell_m);

    std::vector<AnchoredPose> track;
    double length_m = 0.0;
    double next_check_m = 0.0;     // of drift and information
    double turned_since_m = -1.0;  // length at which the heading left; negative: it has not
    std::uint64_t soundings_read = 0;
    double sum_variance_m2 = 0.0;
    VoxelGrid voxels;
    TerrainInformation terrain;  // about the first ping, map axes
    SubmapSoundings soundings;   // where they are kept; from the origin of `voxels`, anchored map
    std::vector<std::size_t> voxel_of_sounding;  // kNoVoxel: left out at once
  };
  struct Frame {
    Time time;
    Eigen::Vector2d p_map;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.p_map);
    }
  };
  struct Heading {
    double along_m;
    double yaw_rad;
  };

  bool Accept(const GeoreferencedPing& ping);
  std::optional<SubmapTrigger> Break(const GeoreferencedPing& ping) const;
  bool TurnBefore(const GeoreferencedPing& ping);  // one begins or ends
  bool HasLeftHeading(const GeoreferencedPing& ping) const;
  void EndLine() { on_earlier_lines_ = frames_.size(); }
  bool HeadingSettled(double yaw_rad, double along_m);
  void AddSoundings(const GeoreferencedPing& ping);
  void Keep(const Sounding& sounding, const Eigen::Vector3d& p_anchored, std::size_t voxel);
  std::optional<SubmapTrigger> Full();
  bool HasDrifted() const;
  bool HoldsEnoughStructure() const;
  Time NearestOnEarlierLine(const Eigen::Vector2d& p_map) const;
  std::optional<Submap> Close(SubmapTrigger trigger);
  // See Submap::heading_spread.
  static double HeadingSpread(const std::vector<AnchoredPose>& track, double frame_yaw_rad);

  const SubmapParams params_;
  const CloudFilterParams filter_;
  const Drift drift_;
  const Hindsight hindsight_;
  std::optional<Open> open_;
  std::optional<Pose> last_;
  std::bitset<256> heads_;            // that sent a ping at the time of the last one
  double along_m_ = 0.0;              // of the whole track
  double first_yaw_rad_ = 0.0;        // of the submap opened last
  std::vector<Frame> frames_;         // of the submaps closed
  std::size_t on_earlier_lines_ = 0;  // of frames_, the first
  bool turning_ = false;
  std::deque<Heading> headings_;  // of the last turn_settle_m, while turning
  bool keeps_soundings_ = false;
  SubmapSoundings soundings_;  // of the submap closed last
  std::map<std::string, std::int64_t> counters_;
};

}  // namespace seastitch
