#include "mapper/mapper_node.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

constexpr char kName[] = "mapper";
// Graph updates sent at once in answer to a request: about 20 kB. A receiver that needs more
// requests again.
constexpr int kUpdatesAtOnce = 16;
// Consecutive samples outside the time in which a map can be continued that end the wait: then a
// new map begins.
constexpr int kInputsOutside = 5;
constexpr double kCheckpointEveryS = 5.0;
// Time [s] for which HEALTH reports what happened to the map at a restart.
constexpr double kTellRestartS = 60.0;
// Journal entries that may wait for the disk before a closed submap waits without its points.
constexpr std::size_t kMostToWrite = 32;
constexpr std::size_t kMegabyte = 1'000'000;
constexpr double kNoNavS = 2.0;

std::string TimeApart(double silent_s) {
  char text[120];
  if (silent_s < 0.0)
    std::snprintf(text, sizeof text, "the time is %.0f s before its last checkpoint", -silent_s);
  else
    std::snprintf(text, sizeof text, "its last checkpoint is %.0f s ago", silent_s);
  return text;
}

bool IsInput(const ImuSample&, NavigationSource source) {
  return source == NavigationSource::kDeadReckoning;
}
bool IsInput(const NavigationSample&, NavigationSource source) {
  return source == NavigationSource::kGiven;
}
template <class Sample>
bool IsInput(const Sample&, NavigationSource) {
  return false;
}

}  // namespace

MapperNode::MapperNode(const MapperConfig& config, Bus* bus, Worker* worker)
    : bus_(bus), worker_(worker), writer_(&inline_), config_(config), mapper_(config) {
  SurveyStore::MakeDirectory(config_.map_dir);
  archive_ = MakeArchive(config_.map_dir);
  Subscribe();
}

MapperNode::MapperNode(
    const MapperConfig& config, Bus* bus, Worker* worker, Worker* writer, FoundMap found)
    : bus_(bus),
      worker_(worker),
      writer_(writer),
      config_(config),
      mapper_(config),
      found_(std::move(found)) {
  Subscribe();
}

void MapperNode::Subscribe() {
  SubscribeSensors();
  SubscribeOptimizer();
  health_.ReadFrom({[this] {
                      Counters counters = mapper_.counters();
                      counters.merge(inbox_.counters());
                      return counters;
                    },
                    [this] { return mapper_.Summary(); }});
  health_.SetStarting(mapper_.WaitsFor());
}

std::shared_ptr<MapperNode::Archive> MapperNode::MakeArchive(
    const std::filesystem::path& folder) const {
  return std::make_shared<Archive>(
      SurveyStoreParams{folder, config_.max_cached_mb, config_.max_unsaved_mb},
      config_.loop_closer.registration);
}

void MapperNode::SubscribeSensors() {
  Subscribe<imu_t>(channels::kImu);
  Subscribe<dvl_t>(channels::kDvl);
  Subscribe<depth_t>(channels::kDepth);
  Subscribe<navigation_t>(channels::kIns);
  Subscribe<position_fix_t>(channels::kPositionFix);
  Subscribe<mbes_ping_t>(channels::kMbesPing);
  Subscribe<mbes_soundings_t>(channels::kMbesSoundings);
  Subscribe<sound_velocity_profile_t>(channels::kSvp);
  bus_->Subscribe<health_t>(
      channels::kHealth, QueueOf(channels::kHealth), [this](const health_t& msg) {
        if (const auto heartbeat = FromLcm(msg)) mapper_.OnHeartbeat(*heartbeat);
        ReportHealth();
      });
}

void MapperNode::SubscribeOptimizer() {
  bus_->Subscribe<pose_graph_t>(channels::kPoseGraph,
                                QueueOf(channels::kPoseGraph),
                                [this, watch = SequenceWatch()](const pose_graph_t& msg) mutable {
                                  if (watch.Add(msg.seq) > 0) RequestSolution();
                                  OnPoseGraph(msg);
                                });
  bus_->Subscribe<graph_request_t>(channels::kGraphRequest,
                                   QueueOf(channels::kGraphRequest),
                                   [this](const graph_request_t& msg) { OnGraphRequest(msg); });
  bus_->Subscribe<covariances_t>(channels::kCovariances,
                                 QueueOf(channels::kCovariances),
                                 [this](const covariances_t& msg) { OnCovariances(msg); });
}

template <class Msg>
void MapperNode::Subscribe(const char* channel) {
  using T = typename decltype(FromLcm(Msg{}))::value_type;
  bus_->Subscribe<Msg>(channel, QueueOf(channel), [this](const Msg& msg) {
    health_.Tick(NameOf(T{}));
    if (const auto received = inbox_.Take(msg, mapper_.health_time_s()))
      Add(std::get<T>(received->sample), received->stamp);
    else
      ReportHealth();
  });
}

template <class T>
void MapperNode::Add(const T& sample, const MessageStamp& stamp) {
  if (found_ && IsInput(sample, config_.navigation_source) && !Begin(sample, stamp)) return;
  mapper_.Add(sample, stamp);
  Deliver();
  if constexpr (kIsOfNavigation<T>) {
    SendWaiting();
    LookAgain();
  }
  if (!kIsOfNavigation<T> || mapper_.IsWaiting()) ReportHealth();  // otherwise with every NAV
}

void MapperNode::CountMalformed(const std::string& name) {
  inbox_.CountMalformed(name, mapper_.health_time_s());
  ReportHealth();
}

void MapperNode::OnPoseGraph(const pose_graph_t& msg) {
  health_.Tick("pose_graph");
  const std::optional<PoseGraph> solution = pose_graph_.Add(msg);
  health_.Set("pose_graph_malformed", pose_graph_.malformed());
  if (solution) {
    malformed_before_solution_ = pose_graph_.malformed();
    mapper_.Take(*solution);
  }
  ReportHealth();
}

void MapperNode::OnGraphRequest(const graph_request_t& msg) {
  if (msg.sender == kName) return;  // the mapper's own request
  health_.Count("graph_requests");
  const bool same_graph = msg.graph_id == mapper_.graph().graph_id();
  if (!same_graph && msg.graph_id != 0) return;  // another mapper's
  const std::int64_t have = same_graph ? std::max<std::int64_t>(0, msg.have_version) : 0;
  version_sent_ = std::min(version_sent_, have);
  // Some at once, the rest one by one, like the points of a submap.
  for (int i = 0; i < kUpdatesAtOnce && SendNextUpdate(); ++i) {
  }
}

void MapperNode::OnCovariances(const covariances_t& msg) {
  if (msg.recipient != kName) return;
  if (const std::optional<PairCovariances> answer = FromLcm(msg))
    mapper_.Take(*answer);
  else
    CountMalformed("covariances");
}

void MapperNode::RequestSolution() {
  graph_request_t msg{};
  msg.utime = mapper_.last_nav() ? ToUtime(*mapper_.last_nav()) : 0;
  msg.seq = request_seq_++;
  msg.sender = kName;
  msg.graph_id = mapper_.graph().graph_id();
  msg.have_version = mapper_.solution_version();
  bus_->Publish(channels::kGraphRequest, msg);
  health_.Count("solution_requests");
}

// --- after a restart -----------------------------------------------------------------------------

// A single wrong stamp must not decide: kInputsOutside samples in a row are needed.
template <class Sample>
bool MapperNode::Begin(const Sample& input, const MessageStamp& stamp) {
  Time time = input.time;
  if (found_->saved) {
    const Time resumed = mapper_.InDiveTime(found_->saved->checkpoint, input, stamp);
    const double silent_s = ToSeconds(resumed - found_->saved->checkpoint.time);
    const bool within = silent_s >= 0.0 && silent_s <= config_.map_resume_within_s;
    if (!within && ++inputs_outside_ < kInputsOutside) return false;
    if (!within) found_->why_not = TimeApart(silent_s);
    if (within) time = resumed;
  }
  Begin();
  begun_ = time;
  return true;
}

void MapperNode::Begin() {
  FoundMap found = *std::exchange(found_, std::nullopt);
  if (found.why_not.empty()) {
    archive_ = MakeArchive(found.folder);
    if (found.saved && !Resume(*found.saved)) found.why_not = "its navigation cannot be used";
  }
  const bool goes_on = found.saved && found.why_not.empty();
  if (!goes_on)
    for (const SoundVelocityProfile& profile : found.profiles) mapper_.Add(profile);
  OpenJournal(std::move(found));
}

void MapperNode::OpenJournal(FoundMap found) {
  if (!found.lost.empty()) at_restart_.push_back({&conditions::kJournalDamaged, found.lost});
  if (!archive_) archive_ = MakeArchive(found.folder);
  if (!found.why_not.empty()) {
    const std::filesystem::path folder = NextMapFolder(found.folder);
    at_restart_.push_back(
        {&conditions::kMapBegunAnew, found.why_not + "; now in " + folder.filename().string()});
    found = FoundMap{};
    found.folder = folder;
    archive_ = MakeArchive(folder);
  }
  journal_ = std::make_shared<MapJournal>(found, ConfigurationOf(config_), config_.max_unsaved_mb);
}

bool MapperNode::Resume(const SavedMap& saved) {
  SurveyStore& store = archive_->store;
  std::vector<std::shared_ptr<const Submap>> submaps;
  for (const JournalEntry& entry : saved.journal)
    if (const auto* closed = std::get_if<ClosedSubmap>(&entry)) submaps.push_back(closed->submap);
  store.Restore(submaps);
  const auto load = [&store](SubmapId id) { return store.Get(id); };
  if (!mapper_.Resume(saved, load, [this] { health_.ReportProgress(); })) return false;
  if (const std::int64_t unusable = mapper_.entries_unusable(); unusable > 0)
    at_restart_.push_back({&conditions::kJournalDamaged,
                           std::to_string(unusable) + " entries do not continue those before"});
  ReportStore(store.counters());
  // The last submap and graph version may not have been sent before the restart.
  if (!submaps.empty()) {
    stored_ = submaps.back()->id;
    if (const auto last = store.Get(stored_)) Announce(*last);
  }
  version_written_ = mapper_.graph().version();
  version_sent_ = std::max<std::int64_t>(0, version_written_ - 1);
  RequestSolution();
  return true;
}

void MapperNode::AddSubmap(Submap submap) {
  mapper_.AddSubmap(std::move(submap));
  Deliver();
}

bool MapperNode::LookAgain() {
  const bool left = mapper_.LookAgain();
  if (left) PostNextJob();
  Deliver();
  return left;
}

void MapperNode::Finish(const std::function<void()>& pause) {
  while (SendNextChunk()) pause();
  // Navigation never started: what came before it, such as a profile, is for the next start.
  if (found_) OpenJournal(*std::exchange(found_, std::nullopt));
  mapper_.Finish();
  Deliver();
  checkpoint_is_due_ = journal_ != nullptr;
  PostNextWrite();
  SendAll(pause);
  ReportHealth();
}

void MapperNode::SendAll(const std::function<void()>& pause) {
  while (SendNextChunk()) pause();
  while (SendNextUpdate()) pause();
}

void MapperNode::Deliver() {
  is_delivering_ = true;
  for (const MapperEvent& event : mapper_.TakeEvents())
    std::visit([this](const auto& what) { Send(what); }, event);
  is_delivering_ = false;
  PostNextWrite();
  if (mapper_.HasSubmapToRegister() || job_) PostNextJob();
}

void MapperNode::Send(const NavState& state) {
  bus_->Publish(channels::kNav, ToLcm(state, nav_seq_++));
  health_.Tick("nav");
  ReportHealth();
  if (!journal_) return;
  if (checkpoint_time_ && ToSeconds(state.time - *checkpoint_time_) < kCheckpointEveryS) return;
  checkpoint_time_ = state.time;
  checkpoint_is_due_ = true;
}

void MapperNode::Send(const CorrectedNavState& state) {
  bus_->Publish(channels::kNavCorrected, ToLcm(state, corrected_seq_++));
}

void MapperNode::Announce(const Submap& submap) {
  // An announcement ends the previous submap, so that the rest of its points goes first.
  while (SendNextChunk()) {
  }
  SubmapMessages messages = ToLcm(submap, submap_seq_++, points_seq_);
  points_seq_ += static_cast<std::int64_t>(messages.chunks.size());
  bus_->Publish(channels::kSubmap, messages.announcement);
  chunks_.assign(std::make_move_iterator(messages.chunks.begin()),
                 std::make_move_iterator(messages.chunks.end()));
}

// New updates wait behind those that were requested again.
void MapperNode::Send(const GraphStep&) {
  ++updates_due_;
  SendDue();
}

void MapperNode::SendDue() {
  while (updates_due_ > 0 && SendNextUpdate()) --updates_due_;
}

void MapperNode::Send(const JournalEntry& entry) {
  Write write;
  write.time = mapper_.last_nav().value_or(Time());
  if (journal_ || found_) write.entry = Encode(entry);
  if (!archive_) {  // profiles before the first sample of navigation: the last is enough
    to_write_.clear();
    to_write_bytes_ = 0;
  }
  if (const auto* closed = std::get_if<ClosedSubmap>(&entry)) {
    if (const auto checkpoint = journal_ ? mapper_.MakeCheckpoint() : std::nullopt)
      write.checkpoint = Encode(*checkpoint);
    write.submap = closed->submap;
    if (to_write_.size() >= kMostToWrite) {
      // The number stays in the journal and in order; the points would grow without bound.
      Submap without_points = *closed->submap;
      without_points.cloud = {};
      write.submap = std::make_shared<const Submap>(std::move(without_points));
      health_.Set("submaps_not_stored", ++not_stored_);
    }
  }
  if (std::holds_alternative<GraphGrowth>(entry)) write.version = mapper_.graph().version();
  const auto most_bytes = static_cast<std::size_t>(config_.max_unsaved_mb) * kMegabyte;
  const std::size_t bytes = write.bytes();
  if (write.entry && (entries_dropped_ > 0 || to_write_bytes_ + bytes > most_bytes)) {
    write.entry.reset();
    write.checkpoint.clear();
    health_.Set("journal_entries_dropped", ++entries_dropped_);
  }
  to_write_bytes_ += write.bytes();
  to_write_.push_back(std::move(write));
  PostNextWrite();
}

void MapperNode::Send(const CovarianceQuestion& question) {
  CovarianceRequest request = question.request;
  request.sender = kName;
  bus_->Publish(channels::kCovarianceRequest, ToLcm(request, question.submap_time));
}

bool MapperNode::SendNextChunk() {
  if (chunks_.empty()) return false;
  bus_->Publish(channels::kSubmapPoints, chunks_.front());
  chunks_.pop_front();
  return true;
}

bool MapperNode::SendNextUpdate() {
  const GraphStep* step = mapper_.graph().After(version_sent_);
  if (step == nullptr || step->update.version > version_written_) return false;
  bus_->Publish(channels::kGraphUpdate, ToLcm(step->update, step->submap_time, update_seq_++));
  version_sent_ = step->update.version;
  return true;
}

void MapperNode::RepeatNewest() {
  const std::int64_t newest = mapper_.graph().version();
  const bool is_new = std::exchange(version_at_repeat_, newest) != newest;
  if (is_new || version_sent_ < newest || !mapper_.AwaitsSolution()) return;
  version_sent_ = newest - 1;
  if (!SendNextUpdate()) return;
  health_.Count("updates_repeated");
  RequestSolution();
}

void MapperNode::SendWaiting() {
  SendNextChunk();
  SendNextUpdate();
}

// A job that the worker refuses is tried again with the next message. A submap is registered only
// after it is stored, because other jobs load its points.
void MapperNode::PostNextJob() {
  if (!job_) job_ = mapper_.NextJob();
  if (!job_ || (job_->closed && job_->closed->id > stored_)) return;
  const RegistrationJob job = *std::exchange(job_, std::nullopt);
  const bool posted = worker_->Post([this, archive = archive_, params = config_.loop_closer, job] {
    const LoadSubmap load = [&archive](SubmapId id) { return archive->store.Get(id); };
    const auto results =
        std::make_shared<RegistrationResultSet>(Run(job, params, load, &archive->prepared));
    return [this, results] { OnRegistered(std::move(*results)); };
  });
  if (posted) return;
  job_ = job;
  health_.Count("worker_refused");
}

void MapperNode::OnRegistered(RegistrationResultSet results) {
  mapper_.Take(std::move(results));
  Deliver();
  ReportHealth();
}

// --- to the disk ---------------------------------------------------------------------------------

// Writes one entry at a time, in order. A checkpoint is written after all entries before it.
void MapperNode::PostNextWrite() {
  if (is_writing_ || !archive_) return;
  if (to_write_.empty()) return PostCheckpoint();
  is_writing_ = true;
  const auto write = std::make_shared<const Write>(std::move(to_write_.front()));
  to_write_.pop_front();
  const std::size_t bytes = write->bytes();
  to_write_bytes_ -= bytes;
  const bool posted = writer_->Post([this, archive = archive_, journal = journal_, write] {
    Written written;
    if (write->submap && !write->submap->cloud.empty()) archive->store.Put(write->submap);
    if (journal && !write->checkpoint.empty())
      journal->WriteCheckpoint(write->time, write->checkpoint);
    if (journal) written.in_journal = AppendTo(journal.get(), *write);
    if (journal) written.journal_is_gone = journal->is_gone();
    written.store = archive->store.counters();
    return [this, write, written] { OnWritten(*write, written); };
  });
  if (posted) return;
  is_writing_ = false;
  to_write_bytes_ += bytes;
  to_write_.push_front(*write);
}

bool MapperNode::AppendTo(MapJournal* journal, const Write& write) {
  if (write.entry) return journal->Append(write.time, *write.entry);
  journal->End();
  return false;
}

void MapperNode::PostCheckpoint() {
  if (!checkpoint_is_due_ || is_delivering_) return;
  const std::optional<Checkpoint> checkpoint = mapper_.MakeCheckpoint();
  if (!checkpoint) return;
  checkpoint_is_due_ = false;
  is_writing_ = true;
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(Encode(*checkpoint));
  const bool posted = writer_->Post([this, journal = journal_, time = checkpoint->time, bytes] {
    const bool written = journal->WriteCheckpoint(time, *bytes);
    return [this, written, is_gone = journal->is_gone()] {
      is_writing_ = false;
      journal_fails_ = !written;
      journal_is_gone_ = is_gone;
      PostNextWrite();
    };
  });
  if (!posted) is_writing_ = false;
}

void MapperNode::OnWritten(const Write& write, const Written& written) {
  is_writing_ = false;
  journal_fails_ = !written.in_journal;
  journal_is_gone_ = written.journal_is_gone;
  if (write.submap) {
    stored_ = write.submap->id;
    store_fails_ = written.store.write_errors > store_counters_.write_errors;
    Announce(*write.submap);
  }
  ReportStore(written.store);
  if (write.version) version_written_ = *write.version;
  SendDue();
  if (!is_delivering_) Deliver();
}

void MapperNode::ReportHealth() {
  std::vector<Condition> faults = mapper_.conditions();
  AddFaults(&faults);
  // Told from the first input on, also while navigation has not started.
  const std::optional<Time> now = mapper_.last_nav();
  if (begun_ && (!now || ToSeconds(*now - *begun_) < kTellRestartS))
    faults.insert(faults.end(), at_restart_.begin(), at_restart_.end());
  health_.SetConditions(faults);
  if (mapper_.IsWaiting())
    health_.SetStarting(mapper_.WaitsFor());
  else
    health_.SetRunning();
}

void MapperNode::AddFaults(std::vector<Condition>* faults) const {
  if (store_fails_ || journal_fails_ || entries_dropped_ > 0)
    faults->push_back(
        {&conditions::kStoreNotWriting,
         journal_is_gone_ ? "the map's folder was deleted, or another disk hides it: unless it "
                            "comes back, a restart begins a new map"
         : entries_dropped_ == 0 ? ""
                                 : "the journal has ended, and a restart loses what came since"});
  const std::string lost = store_counters_.PointsLost(not_stored_);
  if (!lost.empty()) faults->push_back({&conditions::kPointsLost, lost});
  // A map waits to be continued; Mapper does not know of it yet.
  if (found_ && found_->saved && mapper_.health_time_s() > kNoNavS)
    faults->push_back({&conditions::kNoNavigation, "since the mapper was started again"});
  if (pose_graph_.malformed() > malformed_before_solution_)
    faults->push_back({&conditions::kSolutionsRefused, "its messages are damaged or incomplete"});
  for (Condition& fault : inbox_.Faults(mapper_.health_time_s()))
    faults->push_back(std::move(fault));
}

void MapperNode::ReportStore(const SurveyStoreCounters& store) {
  store_counters_ = store;
  for (const auto& [name, value] : store.ByName()) health_.Set(name, value);
}

}  // namespace seastitch
