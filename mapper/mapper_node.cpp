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
// Consecutive samples outside the time in which a map can be continued that end the wait: then a
// new map begins.
constexpr int kInputsOutside = 5;
// Time [s] for which HEALTH reports what happened to the map at a restart.
constexpr double kTellRestartS = 60.0;
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
    : MapperNode(config, bus, worker, &inline_, std::nullopt) {
  SurveyStore::MakeDirectory(config_.map_dir);
  writer_.OpenStore(config_.map_dir);
}

MapperNode::MapperNode(
    const MapperConfig& config, Bus* bus, Worker* worker, Worker* writer, FoundMap found)
    : MapperNode(config, bus, worker, writer, std::optional(std::move(found))) {
  writer_.ExpectJournal();
}

MapperNode::MapperNode(const MapperConfig& config,
                       Bus* bus,
                       Worker* worker,
                       Worker* writer,
                       std::optional<FoundMap> found)
    : bus_(bus),
      worker_(worker),
      config_(config),
      mapper_(config),
      writer_(
          {config.max_cached_mb, config.max_unsaved_mb, ConfigurationOf(config)},
          writer,
          [this] { return is_delivering_ ? std::nullopt : mapper_.MakeCheckpoint(); },
          [this](const MapWriter::Written& written) { OnWritten(written); }),
      publisher_(&mapper_.graph(), bus),
      found_(std::move(found)),
      prepared_(std::make_shared<PreparedSubmaps>(config.loop_closer.registration)) {
  Subscribe();
}

void MapperNode::Subscribe() {
  SubscribeSensors();
  SubscribeOptimizer();
  health_.ReadFrom({[this] {
                      Counters counters = mapper_.counters();
                      counters.merge(inbox_.counters());
                      counters.merge(writer_.counters());
                      counters[NameOf(HealthValue::kInputMissed)] =
                          inbox_.lost() + mapper_.samples_out_of_time();
                      return counters;
                    },
                    [this] { return mapper_.Summary(); }});
  health_.SetStarting(mapper_.WaitsFor());
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
  publisher_.SendAfter(have);
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
    writer_.OpenStore(found.folder);
    if (found.saved && !Resume(*found.saved)) found.why_not = "its navigation cannot be used";
  }
  const bool goes_on = found.saved && found.why_not.empty();
  if (!goes_on)
    for (const SoundVelocityProfile& profile : found.profiles) mapper_.Add(profile);
  OpenJournal(std::move(found));
}

void MapperNode::OpenJournal(FoundMap found) {
  if (!found.lost.empty()) at_restart_.push_back({&conditions::kJournalDamaged, found.lost});
  if (!found.why_not.empty()) {
    const std::filesystem::path folder = NextMapFolder(found.folder);
    at_restart_.push_back(
        {&conditions::kMapBegunAnew, found.why_not + "; now in " + folder.filename().string()});
    found = FoundMap{};
    found.folder = folder;
    writer_.OpenStore(folder);
  }
  if (!writer_.store()) writer_.OpenStore(found.folder);
  writer_.OpenJournal(found);
}

bool MapperNode::Resume(const SavedMap& saved) {
  SurveyStore& store = *writer_.store();
  std::vector<std::shared_ptr<const Submap>> submaps;
  for (const JournalEntry& entry : saved.journal)
    if (const auto* closed = std::get_if<ClosedSubmap>(&entry)) submaps.push_back(closed->submap);
  store.Restore(submaps);
  const auto load = [&store](SubmapId id) { return store.Get(id); };
  if (!mapper_.Resume(saved, load, [this] { health_.ReportProgress(); })) return false;
  if (const std::int64_t unusable = mapper_.entries_unusable(); unusable > 0)
    at_restart_.push_back({&conditions::kJournalDamaged,
                           std::to_string(unusable) + " entries do not continue those before"});
  // The last submap and graph version may not have been sent before the restart.
  if (!submaps.empty()) {
    writer_.OnRestored(submaps.back()->id);
    if (const auto last = store.Get(writer_.stored())) publisher_.Announce(*last);
  }
  publisher_.Resume();
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
  while (publisher_.SendNextChunk()) pause();
  // Navigation never started: what came before it, such as a profile, is for the next start.
  if (found_) OpenJournal(*std::exchange(found_, std::nullopt));
  mapper_.Finish();
  Deliver();
  writer_.CheckpointIsDue();
  writer_.Post();
  SendAll(pause);
  ReportHealth();
}

void MapperNode::SendAll(const std::function<void()>& pause) {
  while (publisher_.SendNextChunk()) pause();
  while (publisher_.SendNextUpdate()) pause();
}

void MapperNode::Deliver() {
  is_delivering_ = true;
  for (const MapperEvent& event : mapper_.TakeEvents())
    std::visit([this](const auto& what) { Send(what); }, event);
  is_delivering_ = false;
  writer_.Post();
  if (mapper_.HasSubmapToRegister() || job_) PostNextJob();
}

void MapperNode::Send(const NavState& state) {
  bus_->Publish(channels::kNav, ToLcm(state, nav_seq_++));
  health_.Tick("nav");
  ReportHealth();
  writer_.OnNavigation(state.time);
}

void MapperNode::Send(const CorrectedNavState& state) {
  bus_->Publish(channels::kNavCorrected, ToLcm(state, corrected_seq_++));
}

void MapperNode::Send(const GraphStep&) { publisher_.AddNew(); }

void MapperNode::Send(const JournalEntry& entry) {
  const bool with_checkpoint = std::holds_alternative<ClosedSubmap>(entry) && writer_.has_journal();
  writer_.Add(entry,
              mapper_.last_nav().value_or(Time()),
              mapper_.graph().version(),
              with_checkpoint ? mapper_.MakeCheckpoint() : std::nullopt);
}

void MapperNode::Send(const CovarianceQuestion& question) {
  CovarianceRequest request = question.request;
  request.sender = kName;
  bus_->Publish(channels::kCovarianceRequest, ToLcm(request, question.submap_time));
}

void MapperNode::RepeatNewest() {
  if (!publisher_.IsNewestOld() || !mapper_.AwaitsSolution() || !publisher_.SendNewestAgain())
    return;
  health_.Count("updates_repeated");
  RequestSolution();
}

void MapperNode::SendWaiting() {
  publisher_.SendNextChunk();
  publisher_.SendNextUpdate();
}

// A job that the worker refuses is tried again with the next message. A submap is registered only
// after it is stored, because other jobs load its points.
void MapperNode::PostNextJob() {
  if (!job_) job_ = mapper_.NextJob();
  if (!job_ || (job_->closed && job_->closed->id > writer_.stored())) return;
  const RegistrationJob job = *std::exchange(job_, std::nullopt);
  const bool posted = worker_->Post(
      [this, store = writer_.store(), prepared = prepared_, params = config_.loop_closer, job] {
        const LoadSubmap load = [&store](SubmapId id) { return store->Get(id); };
        const auto results =
            std::make_shared<RegistrationResultSet>(Run(job, params, load, prepared.get()));
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

void MapperNode::OnWritten(const MapWriter::Written& written) {
  if (written.submap) publisher_.Announce(*written.submap);
  if (written.version) publisher_.Allow(*written.version);
  publisher_.SendNew();
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
  writer_.AddFaults(faults);
  // A map waits to be continued; Mapper does not know of it yet.
  if (found_ && found_->saved && mapper_.health_time_s() > kNoNavS)
    faults->push_back({&conditions::kNoNavigation, "since the mapper was started again"});
  if (pose_graph_.malformed() > malformed_before_solution_)
    faults->push_back({&conditions::kSolutionsRefused, "its messages are damaged or incomplete"});
  for (Condition& fault : inbox_.Faults(mapper_.health_time_s()))
    faults->push_back(std::move(fault));
}

}  // namespace seastitch
