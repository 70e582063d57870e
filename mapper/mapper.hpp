#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/health/conditions.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "mapper/geometry/calibrated_motion.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/health/ins_monitor.hpp"
#include "mapper/health/navigation_watch.hpp"
#include "mapper/health/ping_watch.hpp"
#include "mapper/health/stamp_offset_record.hpp"
#include "mapper/input/ping_placer.hpp"
#include "mapper/input/ping_queue.hpp"
#include "mapper/input/rewind_watch.hpp"
#include "mapper/input/sensor_clocks.hpp"
#include "mapper/input/sound_speed.hpp"
#include "mapper/loops/graph_log.hpp"
#include "mapper/loops/loop_search.hpp"
#include "mapper/loops/registration_job.hpp"
#include "mapper/mapper_params.hpp"
#include "mapper/nav_correction.hpp"
#include "mapper/navigation/navigation.hpp"
#include "mapper/restart/saved_map.hpp"
#include "mapper/submap_frames.hpp"
#include "mapper/submaps/submap_builder.hpp"

namespace seastitch {

// Request to the optimizer for the covariances of pairs of submaps. Its answer, PairCovariances,
// goes to Mapper::Take().
struct CovarianceQuestion {
  CovarianceRequest request;
  Time submap_time;  // time of the newest submap's frame in the graph
};

// Output of a mapper: a dead-reckoned vehicle state (NAV), the same state corrected by the
// optimized graph, a closed submap with its points, a version of the graph, a covariance request;
// and entries of the write-ahead journal. A journal entry comes in the queue before the event that
// it records: store it first, and nothing that others saw is lost in a restart.
using MapperEvent = std::variant<NavState,
                                 CorrectedNavState,
                                 std::shared_ptr<const Submap>,
                                 GraphStep,
                                 CovarianceQuestion,
                                 JournalEntry>;

// Mapper of one dive, without input and output: sensor samples in; navigation, submaps and the
// graph out. Poses are T_map_vehicle: map axes north, east, down from the datum, vehicle axes
// forward, right, down. It uses no bus, thread, clock or file. A registration is a plain struct
// that NextJob() returns, one at a time; the caller runs it, on any thread, and passes the results
// to Take().
//
//   mapper.Add(sample);
//   while (auto job = mapper.NextJob()) mapper.Take(Run(*job, params, load, &prepared));
//   for (const MapperEvent& event : mapper.TakeEvents()) ...
//
// Run() is in registration_job.hpp; load gives the cloud of a closed submap, and prepared is a
// cache. For a restart, store every JournalEntry and, before that of a closed submap and every
// few seconds, MakeCheckpoint(): what comes between the last checkpoint and the restart is a gap in
// the data; see Resume(). With an optimizer, its solutions go to Take(), and LookAgain() is called
// while there is time.
class Mapper {
 public:
  // Throws std::invalid_argument where params.navigation breaks a rule of CheckParams().
  explicit Mapper(const MapperParams& params);
  // With a navigation of your own in place of the one that params.navigation_source names.
  Mapper(const MapperParams& params, std::unique_ptr<Navigation> navigation)
      : Mapper(params, std::move(navigation), false) {}
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  // Samples, each with its time in sample.time. One that navigation or the submaps refuse (late,
  // not finite, ...) is counted by reason in counters().
  void Add(const ImuSample& sample) {
    watch_.Add(sample);
    Navigate(sample);
  }
  void Add(const DvlSample& sample) {
    watch_.Add(sample);
    Navigate(sample);
  }
  void Add(const DepthSample& sample);
  void Add(const PositionFix& fix) { Navigate(fix); }
  void Add(const NavigationSample& sample);
  void Add(const MbesPing& ping);
  void Add(const SoundingPing& ping);
  void Add(const SoundVelocityProfile& profile) { AddProfile(profile, Time()); }

  // Adds a sample that came in a message, after its time is corrected for steps of the sensor's and
  // the computer's clock: see SensorClocks.
  template <class Sample>
  void Add(Sample sample, const MessageStamp& stamp) {
    sample.time = clocks_.InDiveTime(ChannelOf(sample), sample.time, stamp, DurationOf(sample));
    if (clocks_.TakeRestart()) RestartNavigation();
    if (last_nav_) rewind_.Add(ChannelOf(sample), sample.time);
    Add(sample);
    if (last_nav_ != nav_seen_) nav_came_at_ = clocks_.newest();
    nav_seen_ = last_nav_;
  }
  // The profile is used from its message's time on, not from the profile's own: see SoundSpeed.
  void Add(SoundVelocityProfile profile, const MessageStamp& stamp);
  // Heartbeat of any process on this computer: it tells steps of the computer's clock, and time
  // goes on by it while the sensors are silent. See SensorClocks.
  void OnHeartbeat(const Heartbeat& heartbeat);

  // Sets a callback that gets every sounding of each submap that closes, before the submap's event
  // and on the thread of Add(). A submap's cloud holds the filtered and thinned points only. A
  // later call replaces the callback.
  void OnSoundings(std::function<void(SubmapSoundings)> take);

  // Submaps are filtered by for_each; soundings are placed by one queue of jobs and sorted into
  // their submap by another, each job of which runs after those added to the first before it. In
  // turn if it is not called. The results are the same. Both queues must end before this object.
  void UseThreads(ForEach for_each, JobQueue* placing, JobQueue* sorting) {
    placer_.UseJobs(placing);
    builder_.UseThreads(std::move(for_each), sorting);
  }

  // Sets a callback that gets the smoothed track (Navigation::TakeSmoothed()) in parts, in order of
  // time, the last from Finish(). A later call replaces the callback.
  void OnSmoothed(std::function<void(const SmoothedPose&)> take) { on_smoothed_ = std::move(take); }

  // Adds a closed submap that was made elsewhere, from a file or by another Mapper, to the
  // graph. An id below 0 becomes the next number; one that is not above all before it is refused
  // and counted. Footprint and predicted information (Submap) are computed where they are missing.
  void AddSubmap(Submap submap) { AddSubmap(std::move(submap), {OwnChain(), {}}); }
  // Adds a submap of one dive of several to a common graph, made from sensor data by a
  // Mapper of that dive: with the dive's chain, and position edges from that dive's position fixes.
  // The journal does not hold the chain, so a graph of several dives cannot be resumed.
  struct OfDive {
    Chain chain;
    std::vector<GraphEdge> position_edges;  // absolute positions of this submap or earlier ones
    // Of a submap in a finished map: the jobs that ran when that map was made, from this
    // submap on and before the next. They are recorded and not run again.
    std::vector<RegistrationResultSet> replayed_jobs{};
  };
  void AddSubmap(Submap submap, OfDive dive);

  // Returns the next job: the registrations of the oldest submap that waits, else those that
  // LookAgain() chose. std::nullopt without one, and until the results of the job before have come
  // to Take(). Submaps join the graph in their order, each with the results of its job.
  std::optional<RegistrationJob> NextJob();
  bool HasSubmapToRegister() const { return !job_is_out_ && !submaps_.empty(); }
  // Those that closed and are not in the graph yet.
  std::size_t submaps_to_register() const { return submaps_.size(); }
  bool IsRegistering() const { return job_is_out_ || !submaps_.empty(); }
  // Takes the results of the job that NextJob() returned last.
  void Take(RegistrationResultSet results);

  // Looks for retries at one submap whose pose or covariance the last solution changed: some of its
  // pairs may be registered for the first time, or again. The first call after a solution requests
  // the covariances of their relative poses (an event); later calls use the answer. False where
  // there is nothing to do until a job ends, or until the next solution or answer comes.
  bool LookAgain();

  // Messages from the optimizer. False: counted and not used, since it is of another graph, older,
  // not finite, or withheld (docs/terminology.md); nothing is to be done.
  bool Take(const PoseGraph& solution);
  bool Take(const PairCovariances& answer);

  // Ends the dive, after the last sample: georeferences the pings that wait and closes the last
  // submap. With the results of the last job the graph gets its final version.
  void Finish();

  // The state that changes with every sample and is needed after a restart. std::nullopt before
  // navigation has started.
  std::optional<Checkpoint> MakeCheckpoint();
  // Continues a graph after a restart. Call it before the first sample of the inertial unit (or
  // INS); the time between the checkpoint and that sample is bridged like any gap in the data. The
  // submap that was open is lost; those that were not registered yet will be. load: the clouds of
  // closed submaps. False: `saved` is not usable, and nothing changes.
  // progress is called after each journal entry: a long dive takes seconds.
  bool Resume(
      const SavedMap& saved, const LoadSubmap& load, const std::function<void()>& progress = [] {});
  // Entries of the saved journal that Resume() could not use, from the first such one on.
  std::int64_t entries_unusable() const { return entries_unusable_; }
  // The corrected time (SensorClocks) of the first sample after a restart, by the clocks as they
  // are in the checkpoint: to decide, before Resume(), whether the checkpoint is recent enough.
  template <class Sample>
  Time InDiveTime(const Checkpoint& checkpoint,
                  const Sample& sample,
                  const MessageStamp& stamp) const {
    return ClocksOf(checkpoint).InDiveTime(ChannelOf(sample), sample.time, stamp);
  }

  // What happened since the last call, in order.
  std::vector<MapperEvent> TakeEvents();

  // All versions of the graph so far, for a receiver that missed some.
  const GraphLog& graph() const { return graph_; }
  std::int64_t solution_version() const { return search_.solution_version(); }
  // Whether the optimizer owes a solution of the newest version.
  bool AwaitsSolution() const;
  std::optional<Time> last_nav() const { return last_nav_; }
  // True once the time of the sensors went back as a whole (RewindWatch): nothing that comes can be
  // used here, and another mapper has to begin a new map.
  bool TimeWentBack() const { return rewind_.IsSure(); }
  // See SensorClocks.
  double health_time_s() const { return clocks_.health_time_s(); }

  // Neither navigation nor a submap yet.
  bool IsWaiting() const { return !last_nav_ && graph_.empty(); }
  // What it waits for, in words to act on.
  std::string WaitsFor() const;
  // Estimates of the survey's noise components, from overlaps, and of the time offset of the
  // sonar's stamps, from the seabed.
  SurveyNoise noise() const;
  // The last solution of the graph made the map worse, and was withheld.
  bool has_withheld() const { return search_.harm().has_value(); }
  // Pings that no submap got.
  PingTally pings_lost() const;
  // Positions of an INS that are too far from the datum to be used.
  // Samples that came too late, or with a time too far ahead.
  std::int64_t samples_out_of_time() const { return navigation_->tally().out_of_time(); }
  std::int64_t positions_too_far() const { return navigation_->tally().too_far(); }
  // Time offsets of attitude and DVL that navigation suspected, the best estimate of each.
  std::vector<StampOffsetEstimate> stamp_offsets() const { return stamp_offsets_.estimates(); }
  // Angle of the Doppler log about the vertical beyond vehicle.yaml, clockwise from above, as
  // navigation and the last solution estimate it. Absent: what navigation estimates is within
  // kAdviceSigmas of the configuration.
  std::optional<double> dvl_turned_rad() const;
  // Faults that hold now.
  std::vector<Condition> conditions() const;
  // Everything counted, by name, such as "pings_without_pose".
  Counters counters() const;
  // One line for people: submaps, closures, soundings rejected.
  std::string Summary() const;

 private:
  Mapper(const MapperParams& params, std::unique_ptr<Navigation> navigation, bool own_navigation);

  struct Waiting {
    std::shared_ptr<const Submap> submap;
    OfDive dive;
    bool skip_registration = false;
  };

  // That of the submaps which this mapper makes itself.
  Chain OwnChain() const { return {0, std::nullopt, params_.mounting}; }
  template <class Sample>
  void Navigate(const Sample& sample);
  void AddProfile(const SoundVelocityProfile& profile, Time received);
  // Forgets all states so far: they are by a clock that was wrong. No submap is made of
  // them.
  void RestartNavigation();
  // That of the dive, for SensorClocks.
  DiveStage Stage() const;
  void GiveNav();
  bool GiveStates();
  void GiveSmoothed(Time until);
  Time FirstStateBefore(Time t) const;
  bool GiveNavAt(Time t);  // false: navigation has no state there
  void GeoreferencePings();
  void AddToSubmap(MbesPing ping);
  void AddToSubmap(const SoundingPing& ping);
  // georeference: see PingPlacer.
  void AddToSubmap(GeoreferencedPing ping, std::function<PingSoundings()> georeference);
  void RefuseWithoutPose(Time ping);
  std::optional<Eigen::Isometry3d> PoseAt(Time t) const;
  std::optional<Eigen::Matrix3d> DriftBetween(Time a, Time b) const;
  static bool IsUsable(const Submap& submap);  // finite numbers
  void OnClosed(Submap submap);
  // See SubmapFrames::FramesFor().
  void AddFramesFor(const std::vector<MapFix>& fixes, std::optional<Time> next);
  void Enqueue(Submap submap, OfDive dive);
  // Appends vertices and edges to the graph as its next version (GraphStep). growth: the journal
  // entry of these versions; its steps are filled in here.
  void Extend(std::vector<GraphVertex> vertices,
              std::vector<GraphEdge> edges,
              Time submap_time,
              GraphGrowth growth);
  void GiveGraph(GraphGrowth growth);
  void AddToCorrection(const GraphUpdate& update);
  void RecordMade(RegistrationResultSet results, Time submap_time);
  SensorClocks ClocksOf(const Checkpoint& checkpoint) const;
  // Replays one journal entry. False where it does not continue the entries before it.
  bool Restore(const SoundVelocityProfile& profile);
  bool Restore(const ClosedSubmap& closed);
  bool Restore(const GraphGrowth& growth);
  // t, or for a t before a restart the nearest time for which navigation still has a covariance.
  Time KnownAt(Time t) const;
  bool IsLastStep() const;
  void Count(const std::string& name, std::int64_t n = 1) { counters_[name] += n; }

  const MapperParams params_;
  std::unique_ptr<Navigation> navigation_;
  const bool own_navigation_;  // made from params_
  SensorClocks clocks_;
  RewindWatch rewind_;
  std::optional<Time> nav_seen_;     // last_nav_ at the last message
  std::optional<Time> nav_came_at_;  // when that state came: SensorClocks::newest()
  double optimizer_heard_s_ = 0.0;   // SensorClocks::health_time_s() at its last HEALTH
  // SensorClocks::health_time_s() since when the graph has been newer than this solution.
  std::optional<double> unsolved_since_s_;
  std::int64_t unsolved_version_ = 0;
  NavigationWatch watch_;
  PingWatch ping_watch_;
  std::int64_t pings_received_ = 0;
  std::optional<Time> nav_began_;  // first state of navigation that this object gave
  InsMonitor ins_monitor_;
  StampOffsetRecord stamp_offsets_;
  VerticalReference vertical_;
  SoundSpeed sound_speed_;
  std::optional<SoundSpeed::Source> sound_speed_source_;  // of the last ping
  PingQueue<MbesPing> pings_;
  PingQueue<SoundingPing> sounding_pings_;
  PingPlacer placer_;
  bool soundings_came_placed_ = false;  // SoundingPing: the sonar georeferences by itself
  SubmapBuilder builder_;
  std::function<void(SubmapSoundings)> on_soundings_;
  std::function<void(const SmoothedPose&)> on_smoothed_;
  std::optional<Time> smoothed_until_;
  SubmapFrames frames_;
  NavCorrection correction_;
  std::optional<Time> newest_input_;  // of the inertial unit (or INS)
  std::optional<Time> last_nav_;

  std::int32_t next_id_ = 0;
  std::deque<Waiting> submaps_;          // to be registered; the first may be in a job
  std::vector<LoopPair> again_;          // pairs that LookAgain() chose
  bool job_is_out_ = false;              // with the caller
  std::int64_t failed_in_last_job_ = 0;  // registrations that ended in an exception
  LoopSearch search_;
  std::string solution_refused_;  // reason; empty: the last solution could be used
  GraphLog graph_;
  std::int64_t graph_given_ = 0;     // number of versions that were events so far
  std::int64_t fixes_in_graph_ = 0;  // edges of position fixes, that of the start included
  bool finishing_ = false;

  std::int64_t checkpoint_number_ = 0;
  struct Resumed {
    Time at;                    // of the checkpoint
    std::optional<Time> since;  // of the last submap frame before it, whose pose is still known
  };
  std::optional<Resumed> resumed_;
  std::int64_t entries_unusable_ = 0;
  LoadSubmap load_;  // while it resumes; of submaps that are still compared with solutions

  std::vector<MapperEvent> events_;
  PingTally pings_lost_;  // before the builder
  Counters counters_;
};

}  // namespace seastitch
