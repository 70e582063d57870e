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
#include "mapper/map_store.hpp"
#include "mapper/mapper.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/graph_request_t.hpp"

namespace seastitch {

// A Mapper on the bus: sensor messages in; NAV, NAV_CORRECTED, SUBMAP, SUBMAP_POINTS and
// GRAPH_UPDATE out; the optimizer's POSE_GRAPH and, on a COVARIANCE_REQUEST, COVARIANCES back.
// Converts, counts, stores submaps and posts registrations to the worker, one job at a time. What
// is shown to others is on the disk before, where there is a journal.
class MapperNode {
 public:
  // Without a journal. Throws std::runtime_error where the survey directory cannot be made.
  MapperNode(const MapperConfig& config, Bus* bus, Worker* worker);
  // With one, written by `writer`. The first sample of the inertial unit (or INS) decides whether
  // the map that was found goes on or another begins beside it.
  MapperNode(const MapperConfig& config, Bus* bus, Worker* worker, Worker* writer, FoundMap found);

  // Shows what the mapper gives, besides sending it.
  void Listen(std::function<void(const MapperEvent&)> listener) { listener_ = std::move(listener); }
  // See Mapper::OnSoundings().
  void OnSoundings(std::function<void(const SubmapSoundings&)> take) {
    mapper_.OnSoundings(std::move(take));
  }
  // A finished submap from elsewhere: see Mapper::AddSubmap().
  void AddSubmap(Submap submap);
  void AddSubmap(Submap submap, Mapper::OfDive dive);

  // No more messages come: geo-references what waits, closes the last submap, publishes what is
  // still to be sent, as SendAll(). With a ThreadWorker, its Finish() then brings the last
  // registrations and writes; SendAll() sends what they give.
  void Finish(const std::function<void()>& pause = [] {});
  // Everything that may be sent. pause() is called after every message, so that receivers can
  // follow.
  void SendAll(const std::function<void()>& pause);

  // Something is being registered or written, or waits for it.
  bool IsBusy() const { return is_writing_ || !to_write_.empty() || mapper_.IsRegistering(); }

  // As with every message of navigation: see Mapper::LookAgain().
  bool LookAgain();

  // A chunk of a submap's points and a graph update of those that wait, as also goes with every
  // message of navigation: sent at once, a megabyte would overrun the receivers' buffers. Live, by
  // a timer too: an optimizer that asks for the graph must have it when the sensors are off.
  void SendWaiting();

  // Whether it has gone on in the map that was found, or begun another.
  bool HasBegun() const { return begun_.has_value(); }

  Health& health() { return health_; }
  const Mapper& mapper() const { return mapper_; }

 private:
  // What jobs use and nobody else: they run one at a time.
  struct Archive {
    Archive(const SurveyStoreParams& params, const RegistrationParams& registration)
        : store(params), prepared(registration) {}
    SurveyStore store;  // the writer puts
    PreparedSubmaps prepared;
  };
  struct Write {
    Time time;
    std::vector<std::uint8_t> entry;
    std::shared_ptr<const Submap> submap;   // that closed
    std::optional<std::int64_t> version{};  // of the graph, which may be sent then
  };
  struct Written {
    bool in_journal = true;
    SurveyStoreCounters store;
  };

  // By the first samples of navigation's input; false: not decided yet.
  template <class Sample>
  bool Begin(const Sample& input, const MessageStamp& stamp);
  void Begin();
  bool Resume(const SavedMap& saved);
  std::shared_ptr<Archive> MakeArchive(const std::filesystem::path& folder) const;

  template <class Msg, class Handler>
  void Subscribe(const char* channel, const std::string& name, Handler handler);
  void Subscribe();
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
  void Send(const std::shared_ptr<const Submap>&) {}  // announced when it is on the disk
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
  void PostCheckpoint();
  void OnWritten(const Write& write, const Written& written);
  void ReportHealth();

  Bus* const bus_;
  Worker* const worker_;
  InlineWorker inline_;
  Worker* const writer_;
  const MapperConfig config_;
  Health health_{"mapper"};
  Mapper mapper_;
  std::shared_ptr<Archive> archive_;     // null before Begin()
  std::optional<FoundMap> found_;        // until it is decided whether it goes on
  int inputs_outside_ = 0;               // of the time in which it may, in a row
  std::shared_ptr<MapJournal> journal_;  // null: none
  std::deque<Write> to_write_;
  bool is_writing_ = false;
  bool is_delivering_ = false;
  std::optional<Time> checkpoint_time_;
  bool checkpoint_is_due_ = false;
  SubmapId stored_;                     // the last submap that was
  bool store_fails_ = false;            // the submap closed last was not written
  bool journal_fails_ = false;          // nor what was to be kept last
  std::optional<Time> begun_;           // with a journal
  std::vector<Condition> at_restart_;   // told for a while
  std::optional<RegistrationJob> job_;  // that the worker has not taken yet

  std::function<void(const MapperEvent&)> listener_;
  PoseGraphAssembler pose_graph_;
  std::deque<submap_points_t> chunks_;  // to be sent
  std::int64_t version_sent_ = 0;       // of the graph
  std::int64_t version_written_ = 0;    // as is what may be sent
  int updates_due_ = 0;                 // new versions, beside those that were asked for again

  std::int64_t nav_seq_ = 0;
  std::int64_t corrected_seq_ = 0;
  std::int64_t submap_seq_ = 0;
  std::int64_t points_seq_ = 0;
  std::int64_t update_seq_ = 0;
  std::int64_t request_seq_ = 0;
};

}  // namespace seastitch
