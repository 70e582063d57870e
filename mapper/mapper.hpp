#pragma once

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

#include "common/core/conditions.hpp"
#include "common/core/graph.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/given_watch.hpp"
#include "mapper/graph_log.hpp"
#include "mapper/loop_search.hpp"
#include "mapper/mapper_params.hpp"
#include "mapper/nav_correction.hpp"
#include "mapper/navigation/navigation.hpp"
#include "mapper/navigation_watch.hpp"
#include "mapper/noise/sonar_timing.hpp"
#include "mapper/ping_queue.hpp"
#include "mapper/registration_job.hpp"
#include "mapper/saved_map.hpp"
#include "mapper/sensor_clocks.hpp"
#include "mapper/sound_speed.hpp"
#include "mapper/submap_frames.hpp"
#include "mapper/submaps/submap_builder.hpp"

namespace seastitch {

// A question for the optimizer; its answer goes to Mapper::Take().
struct CovarianceQuestion {
  CovarianceRequest request;
  Time submap_time;  // frame of the newest submap in the graph
};

// What a mapper gives: a state of NAV, the same in the solved map, a closed submap with its points,
// a version of the graph, a question; and what is to be kept for a restart, before anything that
// shows it to others.
using MapperEvent = std::variant<NavState,
                                 CorrectedNavState,
                                 std::shared_ptr<const Submap>,
                                 GraphStep,
                                 CovarianceQuestion,
                                 JournalEntry>;

// Sensor samples in; navigation, submaps and the graph out. Knows no bus, no thread, no clock and
// no file: registrations are values that it hands out, one at a time, and whose results it takes
// back.
//
//   mapper.Add(sample);
//   while (auto job = mapper.NextJob()) mapper.Take(Run(*job, params, load, &prepared));
//   for (const MapperEvent& event : mapper.TakeEvents()) ...
//
// To survive a restart, keep every JournalEntry and, now and then, MakeCheckpoint(); see Resume().
// With an optimizer, its solutions go to Take() and LookAgain() is called while there is time.
class Mapper {
 public:
  // Throws std::invalid_argument where params.navigation is not usable.
  explicit Mapper(const MapperParams& params);
  Mapper(const MapperParams& params, std::unique_ptr<Navigation> navigation);
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  // Refused samples are counted.
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
  void Add(const SoundVelocityProfile& profile) { Know(profile, Time()); }

  // The same of a message, whose stamps tell when a clock steps: see SensorClocks.
  template <class Sample>
  void Add(Sample sample, const MessageStamp& stamp) {
    sample.time = clocks_.InDiveTime(ChannelOf(sample), sample.time, stamp);
    Add(sample);
    if (last_nav_ != nav_seen_) nav_came_at_ = clocks_.newest();
    nav_seen_ = last_nav_;
  }
  // Holds from when it came, not from its own time: see SoundSpeed.
  void Add(SoundVelocityProfile profile, const MessageStamp& stamp);
  // HEALTH of another process: time that passes while sensors are silent.
  void Hear(const std::string& process, double uptime_s);

  // For who wants every sounding and not only the clouds: called with each submap that closes,
  // before it is given.
  void OnSoundings(std::function<void(const SubmapSoundings&)> take);

  // A finished submap from elsewhere joins the graph. An id below 0 becomes the next number; one
  // that is not above all before it is refused and counted. Footprint and predicted information are
  // added where they are missing.
  void AddSubmap(Submap submap) { AddSubmap(std::move(submap), {}); }
  // The same of one dive of several, which another Mapper has taken from sensors to submaps: with
  // its chain, and what that one knows of its place. A journal does not hold the chain.
  struct OfDive {
    Chain chain;
    std::vector<GraphEdge> position_edges;  // on this submap, or on earlier ones
  };
  void AddSubmap(Submap submap, OfDive dive);

  // The next registrations: of the oldest submap that waits, else those that LookAgain() chose.
  // Nothing while a job is out. Submaps join the graph in their order, each with the result of its
  // job.
  std::optional<RegistrationJob> NextJob();
  bool HasSubmapToRegister() const { return !job_is_out_ && !submaps_.empty(); }
  bool IsRegistering() const { return job_is_out_ || !submaps_.empty(); }
  // What the job that is out gave.
  void Take(RegistrationResultSet results);

  // Looks at one submap again of which the last solution brought news: some of its pairs may be
  // registered for the first time, or once more. Before the first of a solution it asks how well
  // their relative poses are known. False where nothing is left to be done now.
  bool LookAgain();

  // From the optimizer. False: not used.
  bool Take(const PoseGraph& solution);
  bool Take(const PairCovariances& answer);

  // No more samples come: geo-references what waits and closes the last submap. When the last job
  // is back, the graph ends with its final version.
  void Finish();

  // All that changes with every sample and is needed after a restart; nothing before navigation has
  // started.
  std::optional<Checkpoint> MakeCheckpoint();
  // Goes on after a restart in the same graph, before the first sample of navigation's inertial
  // unit (or INS): what is missing until then is a gap as any other. The submap that was open is
  // lost; those that were not registered yet will be. load: the clouds of closed submaps. False:
  // not usable, nothing changes.
  bool Resume(const SavedMap& saved, const LoadSubmap& load);
  // Of a sample that comes next after a checkpoint.
  template <class Sample>
  Time InDiveTime(const Checkpoint& checkpoint,
                  const Sample& sample,
                  const MessageStamp& stamp) const {
    return ClocksOf(checkpoint).InDiveTime(ChannelOf(sample), sample.time, stamp);
  }

  // What happened since the last call, in order.
  std::vector<MapperEvent> TakeEvents();

  // Every version so far, for who lacks some.
  const GraphLog& graph() const { return graph_; }
  std::int64_t solution_version() const { return search_.solution_version(); }
  std::optional<Time> last_nav() const { return last_nav_; }

  // Neither navigation nor a submap yet.
  bool IsWaiting() const { return !last_nav_ && graph_.empty(); }
  // What for, in words to act on.
  std::string WaitsFor() const;
  // What the overlaps say of the survey's noise, and the seabed of the sonar's stamps.
  SurveyNoise noise() const;
  // Faults that hold now.
  std::vector<Condition> conditions() const;
  // Everything counted, by name, such as "pings_without_pose".
  std::map<std::string, std::int64_t> counters() const;
  // One line for people: submaps, closures, soundings rejected.
  std::string Summary() const;

 private:
  struct Waiting {
    std::shared_ptr<const Submap> submap;
    std::vector<GraphEdge> position_edges;
    bool skip_registration = false;
    std::int32_t chain = 0;
  };

  template <class Sample>
  void Navigate(const Sample& sample);
  void Know(const SoundVelocityProfile& profile, Time said);
  void GiveNav();
  void GeoreferencePings();
  void AddToSubmap(const MbesPing& ping);
  void AddToSubmap(const SoundingPing& ping);
  void AddToSubmap(const GeoreferencedPing& ping);
  std::optional<Eigen::Isometry3d> PoseAt(Time t) const;
  std::optional<Eigen::Matrix3d> DriftBetween(Time a, Time b) const;
  void OnClosed(Submap submap);
  void Enqueue(Submap submap, OfDive dive);
  // growth: its steps are filled in.
  void Extend(std::vector<GraphVertex> vertices,
              std::vector<GraphEdge> edges,
              Time submap_time,
              GraphGrowth growth);
  void GiveGraph(GraphGrowth growth);
  Checkpoint CheckpointNow();
  SensorClocks ClocksOf(const Checkpoint& checkpoint) const;
  // Each false where the entry does not follow what is here.
  bool Restore(const SoundVelocityProfile& profile);
  bool Restore(const ClosedSubmap& closed);
  bool Restore(const GraphGrowth& growth);
  Time KnownAt(Time t) const;
  bool IsLastStep() const;
  void Count(const std::string& name, std::int64_t n = 1) { counters_[name] += n; }

  const MapperParams params_;
  const std::unique_ptr<Navigation> navigation_;
  SensorClocks clocks_;
  std::optional<Time> nav_seen_;     // the newest
  std::optional<Time> nav_came_at_;  // when it came
  double optimizer_heard_s_ = 0.0;   // by SensorClocks::witnessed_s()
  NavigationWatch watch_;
  GivenWatch given_watch_;
  std::optional<Time> newest_depth_;
  SoundSpeed sound_speed_;
  std::optional<SoundSpeed::Source> sound_speed_source_;  // of the last ping
  PingQueue<MbesPing> pings_;
  PingQueue<SoundingPing> sounding_pings_;
  SonarTiming timing_;
  bool soundings_came_placed_ = false;
  SubmapBuilder builder_;
  std::function<void(const SubmapSoundings&)> on_soundings_;
  SubmapFrames frames_;
  NavCorrection correction_;
  std::optional<Time> last_nav_;

  std::int32_t next_id_ = 0;
  std::deque<Waiting> submaps_;  // to be registered; the first may be out
  std::vector<LoopPair> again_;  // pairs that LookAgain() chose
  bool job_is_out_ = false;
  std::int64_t failed_in_last_job_ = 0;  // registrations
  LoopSearch search_;
  GraphLog graph_;
  std::int64_t graph_given_ = 0;  // versions, as events
  bool finishing_ = false;

  std::int64_t checkpoint_number_ = 0;
  struct Resumed {
    Time at;                    // the checkpoint
    std::optional<Time> since;  // the last frame before it, which navigation still knows
  };
  std::optional<Resumed> resumed_;
  LoadSubmap load_;  // while it resumes; of submaps that are still compared with solutions

  std::vector<MapperEvent> events_;
  std::map<std::string, std::int64_t> counters_;
};

}  // namespace seastitch
