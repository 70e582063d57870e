#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/core/graph.hpp"
#include "common/core/submap.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/worker.hpp"
#include "mapper/loop_closer.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/solution_judge.hpp"
#include "mapper/sound_speed.hpp"
#include "mapper/submaps/submap_builder.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/graph_request_t.hpp"

namespace seastitch {

// Sensor messages in; NAV, SUBMAP, SUBMAP_POINTS and GRAPH_UPDATE out; the optimizer's POSE_GRAPH
// and, on a COVARIANCE_REQUEST, COVARIANCES back. Everything on the loop thread but one job a
// closed submap: store it, register it on its candidates. Jobs run one at a time and in the order
// of the submaps, so graph versions follow the submap ids whatever the worker does. Where no submap
// waits, the worker looks again at pairs of which a solution brought news.
class MapperNode {
 public:
  // Throws std::runtime_error where the survey directory cannot be made.
  MapperNode(const MapperConfig& config, Bus* bus, Worker* worker);

  // The entry of every finished submap, closed here or imported: publishes it, registers it, adds
  // it to the graph. An id below 0 is given the next number; one that is not above all before it is
  // refused and counted. Footprint and predicted information are added where they are missing.
  // position_edges: what is known of its place in the map, or of an earlier one's.
  void AddSubmap(Submap submap, std::vector<GraphEdge> position_edges = {});

  // No more messages come: georeferences what waits, closes the last submap, publishes what is
  // still to be sent, calling pause() after every message so that a receiver can follow. With a
  // ThreadWorker, its Finish() then brings the last registrations.
  void Finish(const std::function<void()>& pause = [] {});

  // Looks at one submap again of which the last solution brought news, as it also does with every
  // message of navigation: some of its pairs may be registered for the first time, or once more.
  // Before the first of a solution it asks the optimizer how well their relative poses are known.
  // False where nothing is left to be done now.
  bool LookAgain();

  // A chunk of a submap's points and a graph update of those that wait, as also goes with every
  // message of navigation: sent at once, a megabyte would overrun the receivers' buffers. Live, by
  // a timer too: an optimizer that asks for the graph must have it when the sensors are off.
  void SendWaiting();

  Health& health() { return health_; }

 private:
  // What jobs use and nobody else: they run one at a time.
  struct Archive {
    Archive(const SurveyStoreParams& params, const RegistrationParams& registration)
        : store(params), prepared(registration) {}
    SurveyStore store;
    PreparedSubmaps prepared;
  };
  struct Waiting {
    std::shared_ptr<const Submap> submap;
    std::vector<GraphEdge> position_edges;
    bool skip_registration = false;
  };
  struct Frame {
    SubmapId id;
    NavState state;
  };
  struct Registered {
    std::shared_ptr<const Submap> closed;  // that joins the graph with it; null: looked at again
    std::vector<LoopPair> pairs;
    std::vector<GraphEdge> edges;
    RegistrationSubmap surface;  // of `closed`
    SurveyStoreCounters store;
  };

  template <class Msg, class Handler>
  void Subscribe(const std::string& channel, int queue, const std::string& name, Handler handler);
  template <class Sample>
  void OnNavigation(const Sample& sample);
  void OnPing(const MbesPing& ping);
  void OnProfile(const SoundVelocityProfile& profile);
  void OnPoseGraph(const pose_graph_t& msg);
  void OnGraphRequest(const graph_request_t& msg);
  void OnCovariances(const covariances_t& msg);
  bool AskForCovariances();
  void RequestSolution();

  void Advance();
  void GeoreferencePings(bool no_more_poses);
  void AddToSubmap(const MbesPing& ping);
  void OnClosed(Submap submap);
  Eigen::Matrix3d DriftBetween(Time a, Time b) const;
  Eigen::Matrix3d CovarianceFromPrevious(const Submap& submap);
  std::vector<GraphEdge> FixEdges(Time until, const std::vector<Frame>& frames);
  void AddLastFixes();
  void PublishNav();
  void PublishSubmap(const Submap& submap);
  bool SendNextChunk();
  void RegisterNext();
  void Register(std::shared_ptr<const Submap> closed, std::vector<LoopPair> pairs);
  void OnRegistered(Registered registered);
  void AddStep(GraphUpdate update, Time submap_time);
  bool SendNextUpdate();
  std::string RejectionText() const;
  void ReportHealth();

  const MapperConfig config_;
  Bus* const bus_;
  Worker* const worker_;
  Health health_{"mapper"};

  DeadReckoning navigation_;
  SoundSpeed sound_speed_;
  std::optional<SoundSpeed::Source> sound_speed_source_;  // of the last ping
  std::deque<MbesPing> pings_;                            // waiting for navigation
  SubmapBuilder builder_;
  std::optional<Frame> previous_frame_;  // of the submap closed last
  std::optional<Time> last_nav_;
  bool bottom_lock_ = false;

  std::shared_ptr<Archive> archive_;
  LoopCloser loop_closer_;
  SolutionJudge judge_;
  std::optional<Judgement> harm_;  // of the last solution, where it was withheld
  PoseGraphAssembler pose_graph_;
  std::int64_t solution_version_ = 0;
  std::int32_t next_id_ = 0;
  std::deque<Waiting> submaps_;  // waiting for the worker; the first may be with it
  bool worker_busy_ = false;
  // max_pairs for every submap, less those made: what lines without a neighbour leave is there for
  // looking again.
  std::int64_t registrations_left_ = 0;
  bool finishing_ = false;

  struct Step {
    GraphUpdate update;
    Time submap_time;
  };
  std::vector<Step> graph_;             // version n at n - 1
  std::size_t updates_sent_ = 0;        // the first of graph_
  std::deque<submap_points_t> chunks_;  // to be sent

  std::int64_t nav_seq_ = 0;
  std::int64_t submap_seq_ = 0;
  std::int64_t points_seq_ = 0;
  std::int64_t update_seq_ = 0;
  std::int64_t request_seq_ = 0;
  std::int64_t covariance_request_seq_ = 0;
  std::int64_t asked_version_ = 0;  // the solution that the last of these was about
  std::optional<Time> asked_time_;
};

}  // namespace seastitch
