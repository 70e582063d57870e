#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/worker.hpp"
#include "mapper/mapper.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/graph_request_t.hpp"

namespace seastitch {

// A Mapper on the bus: sensor messages in; NAV, NAV_CORRECTED, SUBMAP, SUBMAP_POINTS and
// GRAPH_UPDATE out; the optimizer's POSE_GRAPH and, on a COVARIANCE_REQUEST, COVARIANCES back.
// Converts, counts, stores submaps and posts registrations to the worker, one job at a time.
class MapperNode {
 public:
  // Throws std::runtime_error where the survey directory cannot be made.
  MapperNode(const MapperConfig& config, Bus* bus, Worker* worker);

  // See Mapper::OnSoundings().
  void OnSoundings(std::function<void(const SubmapSoundings&)> take) {
    mapper_.OnSoundings(std::move(take));
  }
  // A finished submap from elsewhere: see Mapper::AddSubmap().
  void AddSubmap(Submap submap);

  // No more messages come: geo-references what waits, closes the last submap, publishes what is
  // still to be sent, calling pause() after every message so that a receiver can follow. With a
  // ThreadWorker, its Finish() then brings the last registrations.
  void Finish(const std::function<void()>& pause = [] {});

  // As with every message of navigation: see Mapper::LookAgain().
  bool LookAgain();

  // A chunk of a submap's points and a graph update of those that wait, as also goes with every
  // message of navigation: sent at once, a megabyte would overrun the receivers' buffers. Live, by
  // a timer too: an optimizer that asks for the graph must have it when the sensors are off.
  void SendWaiting();

  Health& health() { return health_; }
  const Mapper& mapper() const { return mapper_; }

 private:
  // What jobs use and nobody else: they run one at a time.
  struct Archive {
    Archive(const SurveyStoreParams& params, const RegistrationParams& registration)
        : store(params), prepared(registration) {}
    SurveyStore store;
    PreparedSubmaps prepared;
  };

  template <class Msg, class Handler>
  void Subscribe(const char* channel, const std::string& name, Handler handler);
  void SubscribeSensors();
  void SubscribeOptimizer();
  void OnPoseGraph(const pose_graph_t& msg);
  void OnGraphRequest(const graph_request_t& msg);
  void OnCovariances(const covariances_t& msg);
  void RequestSolution();

  // Sends what the mapper gave and registers the submaps that wait.
  void Deliver();
  void Send(const NavState& state);
  void Send(const CorrectedNavState& state);
  void Send(const std::shared_ptr<const Submap>& submap);
  void Send(const GraphStep& step);
  void Send(const CovarianceQuestion& question);
  void Send(const JournalEntry& entry);
  bool SendNextChunk();
  bool SendNextUpdate();

  void PostNextJob();
  void OnRegistered(RegistrationResultSet results, const SurveyStoreCounters& store);
  void ReportHealth();

  Bus* const bus_;
  Worker* const worker_;
  const LoopCloserParams registration_;
  Health health_{"mapper"};
  Mapper mapper_;
  std::shared_ptr<Archive> archive_;
  bool store_fails_ = false;            // the submap closed last was not written
  std::optional<RegistrationJob> job_;  // that the worker has not taken yet

  PoseGraphAssembler pose_graph_;
  std::deque<submap_points_t> chunks_;  // to be sent
  std::int64_t version_sent_ = 0;       // of the graph

  std::int64_t nav_seq_ = 0;
  std::int64_t corrected_seq_ = 0;
  std::int64_t submap_seq_ = 0;
  std::int64_t points_seq_ = 0;
  std::int64_t update_seq_ = 0;
  std::int64_t request_seq_ = 0;
};

}  // namespace seastitch
