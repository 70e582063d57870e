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
#include "mapper/mapper.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/restart/map_store.hpp"
#include "mapper/submaps/survey_store.hpp"
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
  bool IsBusy() const { return is_writing_ || !to_write_.empty() || mapper_.IsRegistering(); }

  // Retries registrations, as every navigation message does: see Mapper::LookAgain().
  bool LookAgain();

  // Sends the newest version of the graph again and requests its solution, if it was there at the
  // last call and is not solved: either message may have been lost, and no later one shows it.
  // Live, call it by a timer every few seconds.
  void RepeatNewest();

  // Sends one chunk of a submap's points and one graph update, if any wait; every navigation
  // message does so, too. Sending all at once, a megabyte, would overflow the receivers' buffers.
  // Live, call it by a timer: the optimizer must get the graph that it requests also while the
  // sensors are off.
  void SendWaiting();

  // See Mapper: end this node, and begin another one.
  bool TimeWentBack() const { return mapper_.TimeWentBack(); }

  // True when it is decided whether the map that was found is continued.
  bool HasBegun() const { return begun_.has_value(); }

  Health& health() { return health_; }
  const Mapper& mapper() const { return mapper_; }

 private:
  // Used by jobs only, which run one at a time.
  struct Archive {
    Archive(const SurveyStoreParams& params, const RegistrationParams& registration)
        : store(params), prepared(registration) {}
    SurveyStore store;  // written by the writer's jobs
    PreparedSubmaps prepared;
  };
  struct Write {
    Time time;
    std::optional<std::vector<std::uint8_t>> entry;  // absent: dropped, so that the journal ends
    std::shared_ptr<const Submap> submap;            // the submap that closed
    std::vector<std::uint8_t> checkpoint{};          // with it, to be written before the entry
    std::optional<std::int64_t> version{};  // graph version that may be sent after this write
    std::size_t bytes() const { return (entry ? entry->size() : 0) + checkpoint.size(); }
  };
  struct Written {
    bool in_journal = true;
    bool journal_is_gone = false;
    SurveyStoreCounters store;
  };

  // Decides with the first navigation samples whether the map is continued. False: not decided yet.
  template <class Sample>
  bool Begin(const Sample& input, const MessageStamp& stamp);
  void Begin();
  // Opens archive and journal in the folder of the map that was found, or in the next one.
  void OpenJournal(FoundMap found);
  bool Resume(const SavedMap& saved);
  std::shared_ptr<Archive> MakeArchive(const std::filesystem::path& folder) const;

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
  void Announce(const Submap& submap);
  void SendDue();
  bool SendNextChunk();
  bool SendNextUpdate();

  void PostNextJob();
  void OnRegistered(RegistrationResultSet results);
  void PostNextWrite();
  // On the writer's thread. False: it is not on the disk.
  static bool AppendTo(MapJournal* journal, const Write& write);
  void PostCheckpoint();
  void OnWritten(const Write& write, const Written& written);
  void ReportHealth();
  // Faults of the disk, of what it lost, and of messages.
  void AddFaults(std::vector<Condition>* faults) const;
  void ReportStore(const SurveyStoreCounters& store);

  Bus* const bus_;
  Worker* const worker_;
  InlineWorker inline_;
  Worker* const writer_;
  const MapperConfig config_;
  Health health_{"mapper"};
  Mapper mapper_;
  std::shared_ptr<Archive> archive_;  // null before Begin()
  std::optional<FoundMap> found_;     // until it is decided whether it is continued
  int inputs_outside_ = 0;            // consecutive samples too late (or early) to continue the map
  std::shared_ptr<MapJournal> journal_;  // null: without a journal
  std::deque<Write> to_write_;
  std::size_t to_write_bytes_ = 0;    // of the entries in it
  std::int64_t entries_dropped_ = 0;  // beyond max_unsaved_mb: the journal has ended
  bool is_writing_ = false;
  bool is_delivering_ = false;
  std::optional<Time> checkpoint_time_;
  bool checkpoint_is_due_ = false;
  SubmapId stored_;                     // the last submap that was stored
  SurveyStoreCounters store_counters_;  // as of the last write
  std::int64_t not_stored_ = 0;         // submaps whose points were given up in to_write_
  bool store_fails_ = false;            // the last closed submap could not be stored
  bool journal_fails_ = false;          // the last entry could not be written to the journal
  bool journal_is_gone_ = false;        // MapJournal::is_gone()
  std::optional<Time> begun_;           // first sample's time, with a journal
  std::vector<Condition> at_restart_;   // reported for kTellRestartS
  std::optional<RegistrationJob> job_;  // not yet taken by the worker

  MessageInbox inbox_;
  PoseGraphAssembler pose_graph_;
  std::int64_t malformed_before_solution_ = 0;  // pose_graph_.malformed() at the last solution
  std::deque<submap_points_t> chunks_;          // waiting to be sent
  std::int64_t version_sent_ = 0;               // newest graph version sent
  std::int64_t version_at_repeat_ = 0;          // newest version at the last RepeatNewest()
  std::int64_t version_written_ = 0;            // newest graph version that may be sent
  int updates_due_ = 0;  // new versions to send, without those that were requested again

  std::int64_t nav_seq_ = 0;
  std::int64_t corrected_seq_ = 0;
  std::int64_t submap_seq_ = 0;
  std::int64_t points_seq_ = 0;
  std::int64_t update_seq_ = 0;
  std::int64_t request_seq_ = 0;
};

}  // namespace seastitch
