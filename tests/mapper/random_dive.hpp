#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/convert/message_inbox.hpp"
#include "mapper/mapper.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/mapper/noisy_sensors.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/mapper/random_setting.hpp"

// A dive to which anything happens: a mapper, its disk and an optimizer around a vehicle.
namespace seastitch {

// A mapper, what a disk would hold of it, and an optimizer, around a vehicle with two heads.
class Dive {
 public:
  // kUndisturbed: the same way and the same errors of the sensors, and nothing happens.
  enum class Kind { kAsDrawn, kUndisturbed };

  explicit Dive(const std::vector<Happening>& happenings,
                const Setting& setting = {},
                Kind kind = Kind::kAsDrawn)
      : setting_(setting),
        undisturbed_(kind == Kind::kUndisturbed),
        errors_(static_cast<std::uint32_t>(setting.seed)) {
    for (const SensorChannel channel : kSensors) clocks_[channel] = {};
    clocks_[SensorChannel::kPositionFix] = {};
    if (undisturbed_) setting_.speed = 1.0;
    Begin();
    if (setting_.wrong_sensor >= 0)
      clocks_[kSensors[static_cast<std::size_t>(setting_.wrong_sensor)]].utime_s = setting_.wrong_s;
    Drive(15.0);
    if (setting_.wrong_sensor >= 0)
      clocks_[kSensors[static_cast<std::size_t>(setting_.wrong_sensor)]].utime_s = 0.0;
    for (const Happening& h : happenings) {
      random_.seed(static_cast<std::uint32_t>(h.seed));
      happens_ = NameOf(h);
      Happen(h);
      Drive(10.0);
    }
    mapper_->Finish();
    Keep();
    while (HasJob()) Register();
    Settle();
    ExpectOneGraph();
  }

  const std::vector<std::string>& broken() const { return broken_; }
  std::uint64_t digest() const { return digest_; }
  // Conditions that were present during each kind of happening and in the ten seconds after it.
  const std::map<std::string, std::vector<Condition>>& seen() const { return seen_; }
  // A happening was named within 3 s.
  bool is_named() const { return is_named_; }
  // A player passed over a gap in all data so fast that nobody could say so.
  bool is_passed_over() const { return is_passed_over_; }
  // RMS of the position of the submaps in the last solution [m].
  double position_rms_m() const {
    double sum = 0.0;
    for (const SolvedVertex& vertex : solved_graph_.vertices) {
      const Submap& submap = *clouds_.at(vertex.id);
      const Eigen::Vector3d p =
          vehicle_.NearestTrueTo(submap.frame_time - scale_at_.at(vertex.id)).translation();
      sum += std::pow(vertex.T_map_level.x - p.x(), 2) + std::pow(vertex.T_map_level.y - p.y(), 2);
    }
    return std::sqrt(sum /
                     std::max<double>(1.0, static_cast<double>(solved_graph_.vertices.size())));
  }
  std::size_t submaps() const { return solved_graph_.vertices.size(); }

 private:
  struct Clock {
    double utime_s = 0.0;
    double recv_s = 0.0;
    bool silent = false;
    std::int64_t seq = 0;
  };
  using Message = std::variant<imu_t, dvl_t, depth_t, mbes_ping_t, position_fix_t>;

  void Begin() {
    mapper_ = std::make_unique<Mapper>(params_);
    prepared_ = std::make_unique<PreparedSubmaps>(params_.loop_closer.registration);
    inbox_ = {};
    job_.reset();
  }

  static std::string NameOf(const Happening& h) {
    const auto what = static_cast<What>(h.what);
    std::string name = kNames[static_cast<std::size_t>(h.what)];
    if (what == What::kSensorSilent || what == What::kSensorSteps || what == What::kDriverRestart ||
        what == What::kTwoSenders)
      name += std::string(": ") + seastitch::NameOf(kSensors[static_cast<std::size_t>(h.sensor)]);
    if (what == What::kSlowImu) name += ": IMU";
    if (what == What::kFixesByAnotherClock) name += ": POSITION_FIX";
    return name;
  }

  // --- what happens -----------------------------------------------------------------------------

  void Happen(const Happening& h) {
    Clock& clock = clocks_[kSensors[static_cast<std::size_t>(h.sensor)]];
    switch (static_cast<What>(h.what)) {
      case What::kSensorSilent:
        clock.silent = true;
        Fault(h, h.seconds());
        clock.silent = false;
        break;
      case What::kAllSilent:
        for (auto& [channel, each] : clocks_) each.silent = true;
        Sleep(h);
        for (auto& [channel, each] : clocks_) each.silent = false;
        break;
      case What::kComputerSteps:
        if (setting_.speed > 1.0) break;  // the live processes' heartbeats show none
        for (auto& [channel, each] : clocks_) {
          each.utime_s += h.step_s();
          each.recv_s += h.step_s();
        }
        computer_s_ += h.step_s();
        Fault(h, 5.0);
        break;
      case What::kSensorSteps:
        clock.utime_s += h.step_s();
        Fault(h, 5.0);
        break;
      case What::kDuplicates:
        copies_ = 2;
        Drive(5.0);
        copies_ = 1;
        break;
      case What::kReordered:
        delay_s_ = 0.3;
        Drive(5.0);
        delay_s_ = 0.0;
        break;
      case What::kFixes:
        for (int i = 0; i < 5 * h.size; ++i) {
          Send(Fix());
          Drive(0.04);
        }
        break;
      case What::kTwoSenders:
        second_ = kSensors[static_cast<std::size_t>(h.sensor)];
        Fault(h, 6.0);
        second_.reset();
        break;
      case What::kSlowImu: {
        const int every = std::exchange(setting_.imu_every, undisturbed_ ? setting_.imu_every : 25);
        Fault(h, 10.0 + 0.2 * h.size);
        setting_.imu_every = every;
        break;
      }
      case What::kDamaged:
        damaged_share_ = 0.01 + 0.001 * h.size;
        Drive(5.0);
        damaged_share_ = 0.0;
        break;
      case What::kRestart: Restart(std::min(h.seconds(), 1000.0)); break;
      case What::kDriverRestart:  // systemd starts it again after 2 s
        clock.silent = true;
        Drive(2.0);
        clock.silent = false;
        clock.seq = 0;
        break;
      case What::kOptimizerRestart:
        if (undisturbed_) break;
        optimizer_ = PoseGraphOptimizer(OptimizerParams{});
        AddMissing();
        solved_ = 0;
        break;
      case What::kForeignGraph: TakeForeignGraph(h.size); break;
      case What::kFixesByAnotherClock: SendFixesBy(h); break;
    }
  }

  // The solution of another mapper's graph, such as of a bench on the same bus.
  void TakeForeignGraph(int size) {
    if (undisturbed_) return;
    const auto version = mapper_->counters().at("solution_version");
    PoseGraph foreign;
    foreign.graph_id = mapper_->graph().graph_id() + 1 + size;
    foreign.graph_version = mapper_->graph().version();
    for (const auto& [id, cloud] : clouds_) foreign.vertices.push_back({id, {1e3, -1e3, 1.0}});
    if (mapper_->Take(foreign) || mapper_->counters().at("solution_version") != version)
      Broken("a foreign graph is used");
    ++foreign_;
  }
  // GPS time in place of UTC, or a week count that overflowed.
  void SendFixesBy(const Happening& h) {
    Clock& clock = clocks_[SensorChannel::kPositionFix];
    const double ahead_s = h.size % 2 == 0 ? 18.0 : -1024.0 * 7 * 86'400;
    clock.utime_s += ahead_s;
    for (int i = 0; i < 6; ++i) {
      Send(Fix());
      Drive(0.5);
    }
    ExpectSaid(h);
    clock.utime_s -= ahead_s;
  }

  // For so long. After 3 s somebody says so.
  void Fault(const Happening& h, double duration_s) {
    Drive(std::min(duration_s, 3.0));
    if (duration_s > 3.0) ExpectSaid(h);
    Drive(std::max(0.0, duration_s - 3.0));
    if (duration_s > 3.0) ExpectSaid(h);
  }
  // With every sensor off; the processes run.
  void Sleep(const Happening& h) {
    if (undisturbed_) return;
    double step_s = 1.0;
    is_passed_over_ = is_passed_over_ || h.gap_s() / setting_.speed < 3.0;
    for (double slept_s = 0.0; slept_s < h.gap_s(); slept_s += step_s) {
      if (slept_s > 60.0) step_s = 600.0;  // HEALTH was lost too, most of the time
      vehicle_.Sleep(step_s);
      uptime_s_ += step_s;
      SendHeartbeat();
      for (const Condition& condition : AllConditions()) seen_[happens_].push_back(condition);
      // A player passes over a gap in a fraction of the time.
      if (slept_s / setting_.speed >= 2.0) ExpectSaid(h);
    }
  }
  void ExpectSaid(const Happening& h) {
    // Two depth sensors are legal.
    const bool is_legal = h.what == static_cast<int>(What::kTwoSenders) &&
                          kSensors[static_cast<std::size_t>(h.sensor)] == SensorChannel::kDepth;
    if (undisturbed_ || is_legal) return;
    const std::vector<Condition> now = AllConditions();
    const auto says = [&](const ConditionKind& kind) {
      return std::any_of(
          now.begin(), now.end(), [&](const Condition& c) { return c.kind == &kind; });
    };
    const bool stepped = h.what == static_cast<int>(What::kComputerSteps) ||
                         h.what == static_cast<int>(What::kSensorSteps);
    const bool said =
        h.what == static_cast<int>(What::kFixesByAnotherClock) ? says(conditions::kFixClock)
        : h.what == static_cast<int>(What::kTwoSenders)        ? says(conditions::kTwoSenders)
        : h.what == static_cast<int>(What::kSlowImu)           ? says(conditions::kImuTooSlow)
        : stepped                                              ? says(conditions::kClockStep)
                                                               : says(conditions::kSensorSilent);
    is_named_ = is_named_ || said;
    if (!said) Broken(std::string("nobody says: ") + kNames[static_cast<std::size_t>(h.what)]);
  }
  void Restart(double down_s) {
    if (undisturbed_) return Drive(down_s);
    if (!checkpoint_) return Begin();
    is_down_ = true;
    late_.clear();
    Drive(down_s);
    is_down_ = false;
    Begin();
    SavedMap saved;
    saved.checkpoint = *DecodeCheckpoint(*checkpoint_);
    for (const auto& bytes : journal_) saved.journal.push_back(*DecodeJournalEntry(bytes));
    const Clock& imu = clocks_[SensorChannel::kImu];
    ImuSample first;
    first.time = vehicle_.time + FromSeconds(imu.utime_s);
    const Time resumed = mapper_->InDiveTime(saved.checkpoint, first, {Received(imu), imu.seq});
    const double silent_s = ToSeconds(resumed - saved.checkpoint.time);
    if (!(silent_s >= 0.0 && silent_s <= down_s + 20.0))
      Broken("restart after " + std::to_string(down_s) + " s is taken for " +
             std::to_string(silent_s) + " s");
    if (!mapper_->Resume(saved, load_)) Broken("not resumed");
    solved_ = 0;  // it asks for a solution
    if (mapper_->counters().at("journal_entries_unusable") != 0) Broken("journal not usable");
  }

  // --- messages ---------------------------------------------------------------------------------

  void Drive(double duration_s) {
    const int steps = static_cast<int>(std::lround(duration_s / PerfectVehicle::kImuStepS));
    for (int i = 0; i < steps; ++i) {
      uptime_s_ += PerfectVehicle::kImuStepS;
      driven_s_ += PerfectVehicle::kImuStepS;
      const double yaw_rate = 0.12 + 0.05 * std::sin(0.02 * driven_s_);  // round and round
      for (const auto& sample : vehicle_.Step(1.5, yaw_rate))
        std::visit([this](const auto& s) { Send(s); }, sample);
      Deliver();
      if (++steps_ % 50 == 0 && !is_down_) SendHeartbeat();
      if (steps_ % 100 == 0 && !is_down_) {
        Register();
        Look();
        ExpectBoundedQueues();
        for (const Condition& condition : AllConditions()) seen_[happens_].push_back(condition);
      }
      if (steps_ % kSolveEvery == 0 && !is_down_) Solve();
    }
  }
  std::vector<Condition> AllConditions() const {
    std::vector<Condition> all = mapper_->conditions();
    for (Condition& fault : inbox_.Faults(mapper_->health_time_s()))
      all.push_back(std::move(fault));
    return all;
  }
  Time Received(const Clock& clock) const {
    return vehicle_.time + FromSeconds(0.004 + (undisturbed_ ? 0.0 : clock.recv_s));
  }
  // Of a live process, which hears a player.
  void SendHeartbeat() {
    const double uptime_s = uptime_s_ / setting_.speed;
    mapper_->OnHeartbeat({"imu-driver",
                          begin_ + FromSeconds(uptime_s + (undisturbed_ ? 0.0 : computer_s_)),
                          uptime_s});
  }
  template <class Sample>
  void Send(Sample sample) {
    errors_.AddTo(&sample);
    if (std::is_same_v<Sample, ImuSample> && imu_samples_++ % setting_.imu_every != 0) return;
    Clock& clock = clocks_[ChannelOf(sample)];
    if (clock.silent && !undisturbed_) return;
    const Time received = Received(clock);
    if (!undisturbed_) sample.time += FromSeconds(clock.utime_s);
    Post(ToLcm(sample, {received, clock.seq++}));
    if (second_ == ChannelOf(sample) && !undisturbed_)  // another vehicle's, a moment ago
      Post(ToLcm(sample, {received, 1'000'000 + clock.seq}));
    if constexpr (std::is_same_v<Sample, MbesPing>) {  // the other head, at the same time
      sample.head = 1;
      Post(ToLcm(sample, {received, clock.seq++}));
    }
  }
  template <class Msg>
  void Post(Msg msg) {
    if (is_down_) return;
    if (undisturbed_) {
      late_.emplace(vehicle_.time, msg);
      return;
    }
    std::uniform_real_distribution<double> any(0.0, 1.0);
    if (damaged_share_ > 0.0 && any(random_) < damaged_share_) Damage(&msg);
    for (int copy = 0; copy < copies_; ++copy) {
      const double delay_s = delay_s_ > 0.0 ? delay_s_ * any(random_) : 0.0;
      late_.emplace(vehicle_.time + FromSeconds(delay_s), msg);
    }
  }
  // Some bytes; not how many beams there are.
  template <class Msg>
  void Damage(Msg* msg) {
    const double any = std::uniform_real_distribution<double>(-1e9, 1e9)(random_);
    const auto wild = static_cast<std::int64_t>(1e6 * any);
    switch (std::uniform_int_distribution<int>(0, 4)(random_)) {
      case 0: msg->utime += wild; break;
      case 1: msg->recv_utime += wild; break;
      case 2: msg->seq += wild / 1000; break;
      case 3: msg->utime = msg->recv_utime = wild; break;
      default: DamageValues(msg, any);
    }
  }
  static void DamageValues(imu_t* msg, double any) { msg->specific_force_mps2[1] = 1e-8 * any; }
  static void DamageValues(dvl_t* msg, double any) { msg->v_dvl_mps[0] = 1e-7 * any; }
  static void DamageValues(depth_t* msg, double any) { msg->depth_m = any; }
  static void DamageValues(position_fix_t* msg, double any) { msg->latitude_rad = any; }
  static void DamageValues(mbes_ping_t* msg, double any) {
    for (float& twtt_s : msg->twtt_s) twtt_s = static_cast<float>(any);
  }
  void Deliver() {
    while (!late_.empty() && late_.begin()->first <= vehicle_.time) {
      const Message message = std::move(late_.begin()->second);
      late_.erase(late_.begin());
      std::visit(
          [this](const auto& msg) {
            if (const auto received = inbox_.Take(msg, mapper_->health_time_s()))
              std::visit([&](const auto& sample) { Add(sample, received->stamp); },
                         received->sample);
          },
          message);
      Keep();
    }
  }
  template <class Sample>
  void Add(const Sample& sample, const MessageStamp& stamp) {
    if constexpr (!std::is_same_v<Sample, Heartbeat>) {
      const std::optional<Time> before = mapper_->last_nav();
      mapper_->Add(sample, stamp);
      // Dive time is ahead of the truth by so much.
      const std::optional<Time> now = mapper_->last_nav();
      if (now && now != before && delay_s_ == 0.0 && damaged_share_ == 0.0)
        scale_ = *now - vehicle_.time;
    }
  }
  PositionFix Fix() {
    const bool is_off = fixes_++ == 0 && !undisturbed_;
    return vehicle_.Fix("gps", {is_off ? setting_.first_fix_off_m : 0.0, 0.0});
  }

  // --- what comes out ---------------------------------------------------------------------------

  bool HasJob() {
    if (!job_) job_ = mapper_->NextJob();
    return job_.has_value();
  }
  void Register() {
    if (HasJob())
      mapper_->Take(
          Run(*std::exchange(job_, std::nullopt), params_.loop_closer, load_, prepared_.get()));
    Keep();
  }
  // As the optimizer's process does.
  void Solve() {
    const std::int64_t version = optimizer_.version();
    if (version == solved_) return;
    std::optional<PoseGraph> solution = optimizer_.Solve(SolveStart::kWarm);
    if (!solution) return Broken("no solution of version " + std::to_string(version));
    solution->graph_id = mapper_->graph().graph_id();
    solved_ = version;
    PoseGraphAssembler assembler;
    std::optional<PoseGraph> received;
    for (const pose_graph_t& part : ToLcm(*solution, version, vehicle_.time, 0)) {
      Digest(part);
      if (auto whole = assembler.Add(part)) received = std::move(whole);
    }
    if (!received) return Broken("a solution cannot be read");
    mapper_->Take(*received);
    solved_graph_ = *received;
  }
  // The answer to the request of an optimizer that was started again.
  void AddMissing() {
    while (const GraphStep* step = mapper_->graph().After(optimizer_.version()))
      if (!optimizer_.Add(FromLcm(ToLcm(step->update, step->submap_time, 0)).value()))
        return Broken("the optimizer does not add what it lacks");
  }
  bool Look() {
    const bool left = mapper_->LookAgain();
    Keep();
    return left;
  }
  // Until nothing is left to be done: so many times suffice.
  void Settle() {
    Solve();
    for (int i = 0; i < 1000; ++i) {
      if (!Look() && optimizer_.version() == solved_) return;
      Register();
      Solve();
    }
    Broken("mapper and optimizer never come to an end");
  }
  void ExpectBoundedQueues() {
    const auto counters = mapper_->counters();
    const auto expect = [&](const char* queue, std::int64_t most) {
      if (counters.at(queue) > most)
        Broken(std::string(queue) + ": " + std::to_string(counters.at(queue)));
    };
    expect("pings_waiting", params_.max_waiting_pings);
    // After a gap many pings are placed at once. Beyond max_waiting_submaps they are not
    // registered.
    expect("submaps_waiting", 4 * params_.max_waiting_submaps);
  }
  void Keep() {
    for (const MapperEvent& event : mapper_->TakeEvents())
      std::visit([this](const auto& e) { On(e); }, event);
    const auto nav = mapper_->last_nav();
    if (!nav || (checkpointed_ && std::abs(ToSeconds(*nav - *checkpointed_)) < 1.0)) return;
    checkpointed_ = nav;
    if (const auto checkpoint = mapper_->MakeCheckpoint()) KeepCheckpoint(*checkpoint);
  }
  void KeepCheckpoint(const Checkpoint& checkpoint) {
    checkpoint_ = Encode(checkpoint);
    // What waits in navigation is in it.
    if (checkpoint_->size() > 2'000'000)
      Broken("a checkpoint of " + std::to_string(checkpoint_->size()) + " bytes");
  }
  void On(const NavState& nav) { Publish(ToLcm(nav, seq_++)); }
  void On(const CorrectedNavState& nav) { Publish(ToLcm(nav, seq_++)); }
  void On(const CovarianceQuestion& question) {
    Publish(ToLcm(question.request, question.submap_time));
    PairCovariances answer;
    answer.request_seq = question.request.seq;
    answer.graph_version = solved_;
    answer.graph_id = question.request.graph_id;
    answer.pairs = optimizer_.RelativeCovariances(question.request.pairs);
    if (const auto received = FromLcm(ToLcm(answer, question.submap_time, seq_)))
      mapper_->Take(*received);
    else
      Broken("covariances cannot be read");
  }
  void On(const std::shared_ptr<const Submap>& submap) {
    SubmapAssembler assembler;
    const SubmapMessages messages = ToLcm(*submap, seq_, seq_);
    std::optional<Submap> received = assembler.Add(messages.announcement);
    for (const submap_points_t& chunk : messages.chunks)
      if (auto whole = assembler.Add(chunk)) received = whole;
    if (!received) Broken("a submap cannot be read");
    Digest(messages.announcement);
    clouds_[submap->id] = submap;
    scale_at_.emplace(submap->id, scale_);
  }
  void On(const GraphStep& step) {
    Publish(ToLcm(step.update, step.submap_time, seq_++));
    const auto received = FromLcm(ToLcm(step.update, step.submap_time, 0));
    if (received && !optimizer_.Add(*received)) Broken("the optimizer lacks a version");
    ends_ = ends_ || step.update.final;
  }
  void On(const JournalEntry& entry) {
    journal_.push_back(Encode(entry));
    if (const auto* closed = std::get_if<ClosedSubmap>(&entry)) {
      if (const auto checkpoint = mapper_->MakeCheckpoint()) KeepCheckpoint(*checkpoint);
      clouds_[closed->submap->id] = closed->submap;
    }
  }
  template <class Msg>
  void Publish(const Msg& msg) {
    if (!FromLcm(msg)) Broken(std::string("cannot be read: ") + Msg::getTypeName());
    Digest(msg);
  }
  template <class Msg>
  void Digest(const Msg& msg) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    for (const std::uint8_t byte : bytes) digest_ = (digest_ ^ byte) * 1'099'511'628'211U;
  }

  void ExpectOneGraph() {
    const GraphStore& store = optimizer_.store();
    if (store.version() != mapper_->graph().version()) Broken("versions differ");
    std::size_t vertices = 0;
    std::int64_t version = 0;
    while (const GraphStep* step = mapper_->graph().After(version)) {
      version = step->update.version;
      vertices += step->update.vertices.size();
      if (store.Contradicts(FromLcm(ToLcm(step->update, step->submap_time, 0)).value()))
        Broken("version " + std::to_string(version) + " is another one");
    }
    const auto counters = mapper_->counters();
    const auto solution = counters.at("solution_version");
    if (solution != version)
      Broken("the last solution is of version " + std::to_string(solution) + " of " +
             std::to_string(version));
    const auto refused = counters.find("pose_graph_refused");
    if (refused != counters.end() && refused->second > foreign_)
      Broken("the mapper refuses a solution");
    if (store.vertices().size() != vertices) Broken("vertices differ");
    if (vertices != clouds_.size()) Broken("a closed submap is not in the graph");
    for (const auto& [reason, n] : store.counters())
      if (n > 0) Broken("the optimizer refuses: " + reason);
    if (vertices > 0 && !ends_) Broken("the graph does not end");
    if (mapper_->counters().at("submaps_waiting") != 0) Broken("submaps still wait");
  }
  void Broken(const std::string& what) {
    if (broken_.size() < 10) broken_.push_back(what);
  }

  static MapperParams Params() {
    MapperParams params;
    params.submap.max_duration_s = 12.0;
    params.navigation.fix_interval_s = 0.1;
    return params;
  }

  const MapperParams params_ = Params();
  Setting setting_;
  const bool undisturbed_;
  NoisySensors errors_;
  PerfectVehicle vehicle_;
  const Time begin_ = vehicle_.time;
  MessageInbox inbox_;
  std::unique_ptr<Mapper> mapper_;
  std::unique_ptr<PreparedSubmaps> prepared_;
  std::optional<RegistrationJob> job_;
  PoseGraphOptimizer optimizer_{{}};
  std::map<SubmapId, std::shared_ptr<const Submap>> clouds_;
  LoadSubmap load_ = [this](SubmapId id) -> std::shared_ptr<const Submap> {
    const auto found = clouds_.find(id);
    return found == clouds_.end() ? nullptr : found->second;
  };
  std::vector<std::vector<std::uint8_t>> journal_;
  std::optional<std::vector<std::uint8_t>> checkpoint_;
  std::optional<Time> checkpointed_;

  std::mt19937 random_;
  std::map<SensorChannel, Clock> clocks_;
  std::multimap<Time, Message> late_;
  double uptime_s_ = 0.0;
  double driven_s_ = 0.0;
  double computer_s_ = 0.0;  // the computer's clock, ahead of the truth
  double delay_s_ = 0.0;
  double damaged_share_ = 0.0;
  int copies_ = 1;
  bool is_down_ = false;
  std::optional<SensorChannel> second_;  // of which another sender sends too
  std::int64_t imu_samples_ = 0;
  int fixes_ = 0;
  std::string happens_ = "start";
  std::map<std::string, std::vector<Condition>> seen_;
  bool is_named_ = false;
  bool is_passed_over_ = false;
  Duration scale_{};
  std::map<SubmapId, Duration> scale_at_;  // of each submap
  PoseGraph solved_graph_;
  int steps_ = 0;

  std::int64_t seq_ = 0;
  std::int64_t solved_ = 0;   // the newest version
  std::int64_t foreign_ = 0;  // graphs of others that were sent
  bool ends_ = false;
  std::uint64_t digest_ = 14'695'981'039'346'656'037U;
  std::vector<std::string> broken_;
};

}  // namespace seastitch
