// A dive to which anything happens: what must hold whatever it is.

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
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
#include "mapper/mapper.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

// Each property costs minutes: six cases, of up to eight happenings. RC_PARAMS asks for others.
const int kCases = setenv("RC_PARAMS", "seed=1 max_success=6 max_size=8", 0);

enum class What {
  kSensorSilent,
  kAllSilent,
  kComputerSteps,
  kSensorSteps,
  kDuplicates,
  kReordered,
  kFixes,
  kDamaged,
  kRestart,
  kDriverRestart,
  kOptimizerRestart,
  kForeignGraph,
  kFixesByAnotherClock,
};
constexpr int kWhats = 13;
constexpr std::array<const char*, kWhats> kNames{"sensor silent",
                                                 "all silent",
                                                 "computer's clock steps",
                                                 "sensor's clock steps",
                                                 "duplicates",
                                                 "reordered",
                                                 "fixes",
                                                 "damaged",
                                                 "restart",
                                                 "driver restarts",
                                                 "optimizer restarts",
                                                 "foreign graph",
                                                 "fixes by another clock"};
constexpr std::array kSensors{
    SensorChannel::kImu, SensorChannel::kDvl, SensorChannel::kDepth, SensorChannel::kMbesPing};

constexpr int kSolveEvery = 1500;  // inertial samples: 30 s

// Between two of them the dive goes on for ten seconds.
struct Happening {
  int what = 0;
  int size = 0;  // 0 to 100
  int sensor = 0;
  bool back = false;
  int seed = 0;

  // 1 s to 2 h.
  double seconds() const { return std::pow(7200.0, size / 100.0); }
  // 1 s to 10 days.
  double gap_s() const { return std::pow(864'000.0, size / 100.0); }
  double step_s() const { return (back ? -1.0 : 1.0) * (4.0 + seconds()); }
};

std::ostream& operator<<(std::ostream& out, const Happening& h) {
  return out << "{" << kNames[static_cast<std::size_t>(h.what)] << ", " << h.seconds() << " s"
             << (h.back ? " back" : "") << ", sensor " << h.sensor << ", seed " << h.seed << "}";
}

// A mapper, what a disk would hold of it, and an optimizer, around a vehicle with two heads.
class Dive {
 public:
  explicit Dive(const std::vector<Happening>& happenings) {
    for (const SensorChannel channel : kSensors) clocks_[channel] = {};
    clocks_[SensorChannel::kPositionFix] = {};
    Begin();
    Drive(15.0);
    for (const Happening& h : happenings) {
      random_.seed(static_cast<std::uint32_t>(h.seed));
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
    job_.reset();
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
    double step_s = 1.0;
    for (double slept_s = 0.0; slept_s < h.gap_s(); slept_s += step_s) {
      if (slept_s > 60.0) step_s = 600.0;  // HEALTH was lost too, most of the time
      vehicle_.Sleep(step_s);
      uptime_s_ += step_s;
      SendHeartbeat();
      if (slept_s >= 2.0) ExpectSaid(h);
    }
  }
  void ExpectSaid(const Happening& h) {
    const auto now = mapper_->conditions();
    const auto says = [&](const ConditionKind& kind) {
      return std::any_of(
          now.begin(), now.end(), [&](const Condition& c) { return c.kind == &kind; });
    };
    const bool stepped = h.what == static_cast<int>(What::kComputerSteps) ||
                         h.what == static_cast<int>(What::kSensorSteps);
    const bool said = h.what == static_cast<int>(What::kFixesByAnotherClock)
                          ? says(conditions::kFixClock)
                      : stepped ? says(conditions::kClockStep)
                                : says(conditions::kSensorSilent);
    if (!said) Broken(std::string("nobody says: ") + kNames[static_cast<std::size_t>(h.what)]);
  }
  void Restart(double down_s) {
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
    const Time resumed = mapper_->InDiveTime(
        saved.checkpoint, first, {vehicle_.time + FromSeconds(imu.recv_s), imu.seq});
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
      const double yaw_rate = 0.12 + 0.05 * std::sin(0.02 * uptime_s_);  // round and round
      for (const auto& sample : vehicle_.Step(1.5, yaw_rate))
        std::visit([this](const auto& s) { Send(s); }, sample);
      Deliver();
      if (++steps_ % 50 == 0 && !is_down_) SendHeartbeat();
      if (steps_ % 100 == 0 && !is_down_) {
        Register();
        Look();
        ExpectBoundedQueues();
      }
      if (steps_ % kSolveEvery == 0 && !is_down_) Solve();
    }
  }
  void SendHeartbeat() {
    mapper_->OnHeartbeat({"imu-driver", vehicle_.time + FromSeconds(computer_s_), uptime_s_});
  }
  template <class Sample>
  void Send(Sample sample) {
    Clock& clock = clocks_[ChannelOf(sample)];
    if (clock.silent) return;
    const Time received = sample.time + FromSeconds(0.004 + clock.recv_s);
    sample.time += FromSeconds(clock.utime_s);
    Post(ToLcm(sample, {received, clock.seq++}));
    if constexpr (std::is_same_v<Sample, MbesPing>) {  // the other head, at the same time
      sample.head = 1;
      Post(ToLcm(sample, {received, clock.seq++}));
    }
  }
  template <class Msg>
  void Post(Msg msg) {
    if (is_down_) return;
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
            if (const auto sample = FromLcm(msg))
              mapper_->Add(*sample, {FromUtime(msg.recv_utime), msg.seq});
          },
          message);
      Keep();
    }
  }
  PositionFix Fix() const {
    PositionFix fix;
    fix.time = vehicle_.time;
    const Eigen::Vector3d p = vehicle_.TrueAt(vehicle_.time).translation();
    fix.latitude_rad = p.x() / 6335439.3;
    fix.longitude_rad = p.y() / 6378137.0;
    fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
    fix.source = "gps";
    return fix;
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
    expect("submaps_waiting", params_.max_waiting_submaps);
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
      KeepCheckpoint(closed->checkpoint);
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
  PerfectVehicle vehicle_;
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
  double computer_s_ = 0.0;  // the computer's clock, ahead of the truth
  double delay_s_ = 0.0;
  double damaged_share_ = 0.0;
  int copies_ = 1;
  bool is_down_ = false;
  int steps_ = 0;

  std::int64_t seq_ = 0;
  std::int64_t solved_ = 0;   // the newest version
  std::int64_t foreign_ = 0;  // graphs of others that were sent
  bool ends_ = false;
  std::uint64_t digest_ = 14'695'981'039'346'656'037U;
  std::vector<std::string> broken_;
};

}  // namespace
}  // namespace seastitch

namespace rc {
template <>
struct Arbitrary<seastitch::Happening> {
  static Gen<seastitch::Happening> arbitrary() {
    using seastitch::Happening;
    return gen::build<Happening>(gen::set(&Happening::what, gen::inRange(0, seastitch::kWhats)),
                                 gen::set(&Happening::size, gen::resize(100, gen::inRange(0, 101))),
                                 gen::set(&Happening::sensor, gen::inRange(0, 4)),
                                 gen::set(&Happening::back),
                                 gen::set(&Happening::seed, gen::inRange(0, 1000)));
  }
};
}  // namespace rc

namespace seastitch {
namespace {

RC_GTEST_PROP(Lifecycle, HoldsWhateverHappens, (const std::vector<Happening>& happenings)) {
  const Dive dive(happenings);
  for (const std::string& what : dive.broken()) RC_LOG() << what << "\n";
  RC_ASSERT(dive.broken().empty());
  const Dive again(happenings);
  RC_ASSERT(again.digest() == dive.digest());
}

// One of each kind, both ways, so that none is left to chance.
class EachHappening : public testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(EachHappening, IsSurvived) {
  const auto& [what, back] = GetParam();
  std::vector<Happening> happenings;
  // A gap in everything also of ten days.
  const int longest = what == static_cast<int>(What::kAllSilent) ? 100 : 45;
  for (int sensor = 0; sensor < 4; ++sensor)
    happenings.push_back({what, sensor % 2 == 0 ? 45 : longest, sensor, back, sensor});
  const Dive dive(happenings);
  for (const std::string& broken : dive.broken()) ADD_FAILURE() << broken;
}
INSTANTIATE_TEST_SUITE_P(Kinds,
                         EachHappening,
                         testing::Combine(testing::Range(0, kWhats), testing::Bool()),
                         [](const auto& param) {
                           std::string name =
                               kNames[static_cast<std::size_t>(std::get<0>(param.param))];
                           std::erase_if(name, [](char c) { return std::isalpha(c) == 0; });
                           return name + (std::get<1>(param.param) ? "Back" : "");
                         });

}  // namespace
}  // namespace seastitch
