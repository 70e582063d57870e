#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/convert/message_inbox.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/worker.hpp"
#include "mapper/graph_publisher.hpp"
#include "mapper/mapper.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/restart/map_store.hpp"
#include "mapper/restart/map_writer.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/graph_request_t.hpp"

namespace seastitch {

// Connects a Mapper to the bus. Input: sensor messages, and the optimizer's POSE_GRAPH and
// COVARIANCES. Output: NAV, NAV_CORRECTED, SUBMAP, SUBMAP_POINTS, GRAPH_UPDATE and
// COVARIANCE_REQUEST. Stores submaps, and posts registrations to the worker, one job at a time.
// With a journal, everything is written to the disk before it is sent.
class MapperNode {
 public:
  // Without a journal. Throws std::runtime_error if the survey directory cannot be created.
  MapperNode(const MapperConfig& config, Bus* bus, Worker* worker);
  // With a journal, written by `writer`. The first samples of the inertial unit (or INS) decide
  // whether the map that was found is continued or a new one begins beside it.
  MapperNode(const MapperConfig& config, Bus* bus, Worker* worker, Worker* writer, FoundMap found);

  // Adds a finished submap of another source: see Mapper::AddSubmap().
  void AddSubmap(Submap submap);

  // Call it after the last message: georeferences the pings that wait, closes the last submap, and
  // sends what is left, as SendAll(). With a ThreadWorker, call its Finish() and then SendAll() to
  // send the last registrations' results.
  void Finish(const std::function<void()>& pause = [] {});
  // Sends everything that may be sent. Calls pause() after every message, so that receivers can
  // follow.
  void SendAll(const std::function<void()>& pause);

  // True while something is being registered or written, or waits for it.
  bool IsBusy() const { return writer_.IsBusy() || mapper_.IsRegistering(); }

  // Retries registrations, as every navigation message does: see Mapper::LookAgain().
  bool LookAgain();

  // Sends the newest version of the graph again and requests its solution, if it was there at the
  // last call and is not solved: either message may have been lost, and no later one shows it.
  // Live, call it by a timer every few seconds.
  void RepeatNewest();

  // Sends one chunk of a submap's points and one graph update, if any wait; every navigation
  // message does so, too. Live, call it by a timer: the optimizer must get the graph that it
  // requests also while the sensors are off.
  void SendWaiting();

  // See Mapper: end this node, and begin another one.
  bool TimeWentBack() const { return mapper_.TimeWentBack(); }

  // True when it is decided whether the map that was found is continued.
  bool HasBegun() const { return begun_.has_value(); }

  Health& health() { return health_; }
  const Mapper& mapper() const { return mapper_; }

 private:
  MapperNode(const MapperConfig& config,
             Bus* bus,
             Worker* worker,
             Worker* writer,
             std::optional<FoundMap> found);

  // Decides with the first navigation samples whether the map is continued. False: not decided yet.
  template <class Sample>
  bool Begin(const Sample& input, const MessageStamp& stamp);
  void Begin();
  // Opens store and journal in the folder of the map that was found, or in the next one.
  void OpenJournal(FoundMap found);
  bool Resume(const SavedMap& saved);

  template <class Msg>
  void Subscribe(const char* channel);
  template <class T>
  void Add(const T& sample, const MessageStamp& stamp);
  void Subscribe();
  void SubscribeSensors();
  void SubscribeOptimizer();
  void OnPoseGraph(const pose_graph_t& msg);
  void OnGraphRequest(const graph_request_t& msg);
  void OnCovariances(const covariances_t& msg);
  void RequestSolution();
  void CountMalformed(const std::string& name);

  // Sends the mapper's events, and posts the registrations that wait.
  void Deliver();
  void Send(const NavState& state);
  void Send(const CorrectedNavState& state);
  void Send(const std::shared_ptr<const Submap>&) {}  // announced after it is written
  void Send(const GraphStep& step);
  void Send(const CovarianceQuestion& question);
  void Send(const JournalEntry& entry);

  void PostNextJob();
  void OnRegistered(RegistrationResultSet results);
  void OnWritten(const MapWriter::Written& written);
  void ReportHealth();
  // Faults of the disk, of what it lost, and of messages.
  void AddFaults(std::vector<Condition>* faults) const;

  Bus* const bus_;
  Worker* const worker_;
  InlineWorker inline_;
  const MapperConfig config_;
  Health health_{"mapper"};
  Mapper mapper_;
  MessageInbox inbox_;
  MapWriter writer_;
  GraphPublisher publisher_;
  std::optional<FoundMap> found_;  // until it is decided whether it is continued
  int inputs_outside_ = 0;         // consecutive samples too late (or early) to continue the map
  std::optional<Time> begun_;      // first sample's time, with a journal
  std::vector<Condition> at_restart_;  // reported for kTellRestartS
  bool is_delivering_ = false;

  std::shared_ptr<PreparedSubmaps>
      prepared_;                        // used by registrations only, which run one at a time
  std::optional<RegistrationJob> job_;  // not yet taken by the worker

  PoseGraphAssembler pose_graph_;
  std::int64_t malformed_before_solution_ = 0;  // pose_graph_.malformed() at the last solution
  std::int64_t nav_seq_ = 0;
  std::int64_t corrected_seq_ = 0;
  std::int64_t request_seq_ = 0;
};

}  // namespace seastitch
