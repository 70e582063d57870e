#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/for_each.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/placed_soundings.hpp"
#include "common/core/pose.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"
#include "common/parameters/parameters.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/submaps/cloud_filter.hpp"
#include "mapper/submaps/losses.hpp"
#include "mapper/submaps/terrain_information.hpp"
#include "mapper/submaps/voxel_grid.hpp"

namespace seastitch {

struct SubmapParams {
  // Length along the track. Shorter submaps overlap too little for a reliable loop closure; longer
  // ones are distorted by the drift of dead reckoning.
  double min_length_m = 30.0;
  double max_length_m = 100.0;
  // Longest duration, for a vehicle that hovers. Half of NavigationParams::window_s at most, which
  // the configuration checks: covariances reach no further back.
  double max_duration_s = 900.0;
  // Largest drift of dead reckoning from a submap's first ping to its last, 1 sigma in the worst
  // horizontal direction. With bottom lock a submap gets to max_length_m first; without bottom lock
  // the drift comes to this within seconds.
  double max_drift_m = 0.5;
  // Bound on memory and work, whatever the sonar sends.
  int max_soundings = 5'000'000;
  // Smallest number of points after the filter. A submap with fewer is dropped and counted.
  int min_points = 50;

  // Fraction of a submap's area that a later registration is assumed to use. A submap closes when
  // the predicted registration of this fraction would locate it better than dead reckoning does,
  // with respect to the submap of an earlier line that is nearest in the map (on the first line:
  // the first submap).
  double expected_overlap = 0.25;
  // Lower bound of a sounding's sigma: for a sonar that states none or a smaller one, and for
  // relief finer than a cell, which counts as noise.
  double sounding_sigma_m = 0.05;

  // A line ends where the vehicle's heading has differed from that of the submap's first ping by
  // more than turn_rad for turn_sustain_m of track. The next line begins where the heading has
  // stayed within half of turn_rad for turn_settle_m. A gap with a change of heading ends a line
  // too.
  double turn_rad = Deg2Rad(25.0);
  double turn_sustain_m = 4.0;
  double turn_settle_m = 8.0;
  // True: turns become submaps, which tie lines together. False: their soundings are left out,
  // since heading errors distort the fanned-out swath of a turn most.
  bool keep_turns = true;

  // Longest time and distance between two pings of one submap. A gap beyond closes the submap.
  double max_gap_s = 5.0;
  double max_gap_m = 10.0;
};
// Declares the section `submap` of config/mapper.yaml.
void DeclareSubmap(SubmapParams* params, ParameterTable* table);

// Cutter of the stream of georeferenced pings into submaps (III-A-2 of the paper in
// docs/design.md). A submap ends where it has enough information to be registered
// (SubmapTrigger::kInformation), where it gets too long or drifts, where the line ends, and at a
// gap. No sounding is in two submaps. Pure.
class SubmapBuilder {
 public:
  // Drift of dead reckoning between two pings: covariance of (x, y [m], yaw [rad]) of the vehicle
  // at `b` with respect to the vehicle at `a`, level axes of `a`. std::nullopt: unknown, which
  // counts as unbounded.
  using Drift = std::function<std::optional<Eigen::Matrix3d>(Time a, Time b)>;

  // Rigid 2D transform T_anchored_map. Takes positions computed with the filter's state at `t`
  // into the map in which the pose at `anchor` is the published one, so that corrections of heading
  // or position between the two do not bend a submap. See Navigation::Hindsight.
  using Hindsight = std::function<Pose2(Time anchor, Time t)>;

  SubmapBuilder(const SubmapParams& params,
                const CloudFilterParams& filter,
                Drift drift,
                Hindsight hindsight);

  // Adds a ping and returns the submap that it closed, if any. A submap that a gap or a turn closes
  // does not contain the ping. Pings of several heads, or several swaths of one ping, may have the
  // same time; the same soundings again are refused. The caller fills in id,
  // covariance_from_previous and heading_sigma_rad. A job before may add the soundings.
  std::optional<Submap> Add(std::shared_ptr<const GeoreferencedPing> ping);
  std::optional<Submap> Add(const GeoreferencedPing& ping) {
    return Add(std::make_shared<const GeoreferencedPing>(ping));
  }
  // Closes the open submap at the end of the survey.
  std::optional<Submap> Finish();

  // Keeps every sounding from now on, of the open submap and the one closed last: about 20 bytes
  // each.
  void KeepSoundings() { keeps_soundings_ = true; }
  // Filters closed submaps by for_each and adds soundings by jobs; in turn if it is not called.
  void UseThreads(ForEach for_each, JobQueue* jobs) {
    for_each_ = std::move(for_each);
    jobs_ = jobs;
  }
  // Removes and returns the soundings of the submap closed last, without its id.
  SubmapSoundings TakeSoundings() { return std::exchange(soundings_, {}); }

  // Time of the open submap's frame (its middle ping by number), if it were closed now.
  std::optional<Time> frame_time() const;

  const PingTally& pings_lost() const { return pings_lost_; }
  // Soundings left out, by reason, such as "soundings_too_far". Waits for all jobs, as counters().
  const Counters& soundings_lost() const {
    jobs_->Finish();
    return soundings_lost_;
  }
  // Everything left out, by name: these, turns and submaps that are too small.
  Counters counters() const;

  // For a restart. Not saved: open_, soundings_, keeps_soundings_, for_each_ and jobs_; last_,
  // swaths_, turning_ and headings_, which begin anew with the next ping; pings_lost_,
  // soundings_lost_, pings_in_turns_ and submaps_too_small_, which begin anew with the process.
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
  // The open submap.
  struct Open {
    Open(const Eigen::Vector3d& p_map_vehicle, const CloudFilterParams& filter, double cell_m);

    std::vector<AnchoredPose> track;
    double length_m = 0.0;
    double next_check_m = 0.0;     // length at which drift and information are checked next
    double turned_since_m = -1.0;  // length at which turn_rad was exceeded; negative: it is not
    std::uint64_t soundings_read = 0;
    double sum_dvl_yaw_rad = 0.0;
    std::optional<Time> first_without_lock;
    Time last_without_lock;
    // Jobs fill what follows.
    double sum_variance_m2 = 0.0;
    VoxelGrid voxels;
    TerrainInformation terrain;  // about the first ping, map axes
    SubmapSoundings soundings;   // if kept; relative to the origin of `voxels`, anchored map
    std::vector<std::size_t> voxel_of_sounding;  // kNoVoxel: rejected before the filter
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

  using Ping = std::shared_ptr<const GeoreferencedPing>;
  bool Accept(const Ping& ping);
  // Neither a repeated swath nor one too many of its head at one time.
  bool IsNew(const GeoreferencedPing& ping) const;
  std::optional<SubmapTrigger> Break(const GeoreferencedPing& ping) const;
  bool TurnBefore(const GeoreferencedPing& ping);  // a turn begins or ends before this ping
  bool HasLeftHeading(const GeoreferencedPing& ping) const;
  void EndLine() { on_earlier_lines_ = frames_.size(); }
  bool HeadingSettled(double yaw_rad, double along_m);
  void AddPing(const Ping& ping);
  // In a job. number: of the ping in the open submap, from 1.
  void AddSoundings(const GeoreferencedPing& ping,
                    const Eigen::Isometry3d& T_anchored_map,
                    std::uint32_t number);
  void Keep(const Sounding& sounding, const Eigen::Vector3d& p_anchored, std::size_t voxel);
  // Why the open submap ends with its last ping, if it does.
  std::optional<SubmapTrigger> Full();
  bool IsFullOfSoundings() const;
  bool HasDrifted() const;
  bool HoldsEnoughStructure() const;
  Time NearestOnEarlierLine(const Eigen::Vector2d& p_map) const;
  std::optional<Submap> Close(SubmapTrigger trigger);
  double DriftPerM(const Open& open) const;
  // See Submap::heading_spread.
  static double HeadingSpread(const std::vector<AnchoredPose>& track, double frame_yaw_rad);

  const SubmapParams params_;
  const CloudFilterParams filter_;
  const Drift drift_;
  const Hindsight hindsight_;
  std::optional<Open> open_;
  std::optional<Pose> last_;
  std::vector<Ping> swaths_;          // of the time of the last ping
  double along_m_ = 0.0;              // length of the whole track
  double first_yaw_rad_ = 0.0;        // of the submap opened last
  std::vector<Frame> frames_;         // of the submaps closed
  std::size_t on_earlier_lines_ = 0;  // frames_[0 .. this) belong to earlier lines
  bool turning_ = false;
  std::deque<Heading> headings_;  // over the last turn_settle_m, while turning
  bool keeps_soundings_ = false;
  ForEach for_each_ = ForEachInTurn;
  JobQueue* jobs_ = JobsInTurn();
  SubmapSoundings soundings_;  // of the submap closed last
  PingTally pings_lost_;
  Counters soundings_lost_;
  std::int64_t pings_in_turns_ = 0;
  std::int64_t submaps_too_small_ = 0;
};

}  // namespace seastitch
