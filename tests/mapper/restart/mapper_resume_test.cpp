// A Mapper that is stopped after any message and goes on in a new object.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "mapper/mapper.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/support/files.hpp"

namespace seastitch {
namespace {

using Sample =
    std::variant<ImuSample, DvlSample, DepthSample, MbesPing, PositionFix, SoundVelocityProfile>;

// Four lines, and what the vehicle truly did.
struct Recording {
  Recording() {
    Keep(SoundVelocityProfile{vehicle.time, {0.0, 100.0}, {1500.0, 1502.0}});
    Drive(62.0, 0.0);
    for (int line = 1; line < 4; ++line) {
      const double turn_s = kPi * 7.5 / kSpeedMps;
      Drive(turn_s, (line % 2 == 1 ? kPi : -kPi) / turn_s);
      Drive(60.0, 0.0);
    }
  }
  void Drive(double duration_s, double yaw_rate_radps) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle.Step(kSpeedMps, yaw_rate_radps))
        std::visit([this](const auto& s) { Keep(s); }, sample);
      if (samples.size() % 997 == 0) Keep(vehicle.Fix());
    }
  }
  void Keep(Sample sample) { samples.push_back(std::move(sample)); }
  static constexpr double kSpeedMps = 1.5;
  PerfectVehicle vehicle;
  std::vector<Sample> samples;
};

const Recording& TheRecording() {
  static const Recording recording;
  return recording;
}

MapperParams Params() {
  MapperParams params;
  params.navigation.fix_interval_s = 0.1;
  params.submap.max_duration_s = 12.0;
  return params;
}

// What a disk would hold.
struct Disk {
  std::vector<std::vector<std::uint8_t>> journal;
  std::vector<std::uint8_t> checkpoint;
  std::map<SubmapId, std::shared_ptr<const Submap>> clouds;

  SavedMap Read() const {
    SavedMap saved;
    saved.checkpoint = *DecodeCheckpoint(checkpoint);
    for (const auto& bytes : journal) saved.journal.push_back(*DecodeJournalEntry(bytes));
    return saved;
  }
};

// A program around a Mapper. Registrations stay out for a while, as on a thread.
struct Process {
  explicit Process(Disk* d) : disk(d), params(Params()), mapper(params), prepared({}) {}

  void Feed(const Sample& sample) {
    std::visit([this](const auto& s) { mapper.Add(s); }, sample);
    ++fed;
    Keep();
    if (!job && fed % 700 == 0) job = mapper.NextJob();
    if (job && fed % 700 == 350) {
      mapper.Take(Run(*std::exchange(job, std::nullopt), params.loop_closer, load, &prepared));
      Keep();
    }
  }
  void Finish() {
    mapper.Finish();
    Keep();
    if (job)
      mapper.Take(Run(*std::exchange(job, std::nullopt), params.loop_closer, load, &prepared));
    Keep();
    while ((job = mapper.NextJob())) {
      mapper.Take(Run(*std::exchange(job, std::nullopt), params.loop_closer, load, &prepared));
      Keep();
    }
  }
  void Keep() {
    for (const MapperEvent& event : mapper.TakeEvents()) {
      if (const auto* entry = std::get_if<JournalEntry>(&event)) {
        disk->journal.push_back(Encode(*entry));
        if (const auto* closed = std::get_if<ClosedSubmap>(entry)) {
          disk->checkpoint = Encode(*mapper.MakeCheckpoint());
          disk->clouds[closed->submap->id] = closed->submap;
        }
      }
      if (std::holds_alternative<GraphStep>(event))
        noise_at[mapper.graph().version()] = mapper.noise().components;
      const auto* nav = std::get_if<NavState>(&event);
      if (!nav || (checkpointed && ToSeconds(nav->time - *checkpointed) < 1.0)) continue;
      checkpointed = nav->time;
      disk->checkpoint = Encode(*mapper.MakeCheckpoint());
    }
  }
  LoadSubmap load = [this](SubmapId id) -> std::shared_ptr<const Submap> {
    const auto found = disk->clouds.find(id);
    return found == disk->clouds.end() ? nullptr : found->second;
  };

  Disk* const disk;
  const MapperParams params;
  Mapper mapper;
  PreparedSubmaps prepared;
  std::optional<RegistrationJob> job;
  std::optional<Time> checkpointed;
  std::map<std::int64_t, NoiseEstimate> noise_at;  // by graph version
  std::size_t fed = 0;
};

std::vector<GraphStep> StepsOf(const Mapper& mapper) {
  std::vector<GraphStep> steps;
  while (const GraphStep* step = mapper.graph().After(static_cast<std::int64_t>(steps.size())))
    steps.push_back(*step);
  return steps;
}

std::vector<std::uint8_t> BytesOf(const GraphStep& step) {
  GraphGrowth growth;
  growth.steps = {step};
  return Encode(JournalEntry(growth));
}

void ExpectSame(const ComponentEstimate& a, const ComponentEstimate& b) {
  EXPECT_EQ(a.configured, b.configured);
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.log_sigma, b.log_sigma);
}

void ExpectSame(const NoiseEstimate& a, const NoiseEstimate& b) {
  EXPECT_EQ(a.closures, b.closures);
  ExpectSame(a.sounding_variance_ratio, b.sounding_variance_ratio);
  ExpectSame(a.correlated_error_ratio, b.correlated_error_ratio);
  ExpectSame(a.position_walk, b.position_walk);
  ExpectSame(a.heading_walk, b.heading_walk);
}

double Nees(const GraphEdge& edge, const Recording& recording, const Disk& disk) {
  const auto truth = [&](SubmapId id) {
    return LevelPose(recording.vehicle.TrueAt(disk.clouds.at(id)->frame_time));
  };
  const Pose2 is = Inverse(truth(edge.from)) * truth(edge.to);
  Eigen::Vector3d error = edge.T_from_to.Vector() - is.Vector();
  error.z() = WrapAngle(error.z());
  return error.dot(edge.information * error);
}

void ExpectOneWholeGraph(const std::vector<GraphStep>& steps,
                         std::int64_t resumed_at,
                         const Disk& disk) {
  std::set<SubmapId> vertices;
  SubmapId last;
  int fixes = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const GraphUpdate& update = steps[i].update;
    EXPECT_EQ(update.version, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(update.graph_id, steps.front().update.graph_id);
    EXPECT_EQ(update.resumed, update.version == resumed_at + 1) << update.version;
    for (const GraphVertex& vertex : update.vertices) {
      EXPECT_TRUE(vertices.insert(vertex.id).second) << "twice: " << vertex.id.value;
      EXPECT_TRUE(disk.clouds.contains(vertex.id));
      bool joined = last.value < 0;
      for (const GraphEdge& edge : update.edges) {
        if (edge.kind != EdgeKind::kDeadReckoning || edge.from == edge.to) continue;
        joined = joined || (edge.from == last && edge.to == vertex.id);
        EXPECT_LT(Nees(edge, TheRecording(), disk), 16.3)
            << edge.from.value << " to " << edge.to.value << ", 99.9 % of 3 degrees of freedom";
        EXPECT_GT(edge.information(0, 0), 1e-3) << "known to 30 m";
      }
      EXPECT_TRUE(joined) << vertex.id.value;
      last = vertex.id;
    }
    for (const GraphEdge& edge : update.edges) fixes += edge.kind == EdgeKind::kPositionFix;
  }
  EXPECT_EQ(vertices.size(), disk.clouds.size());
  EXPECT_GT(fixes, 0);
  EXPECT_TRUE(steps.back().update.final);
}

int FixesIn(const std::vector<GraphStep>& steps) {
  int fixes = 0;
  for (const GraphStep& step : steps)
    for (const GraphEdge& edge : step.update.edges) fixes += edge.kind == EdgeKind::kPositionFix;
  return fixes;
}

// A journal that ends before the checkpoint: a power cut took its last entries, or the disk. What
// is lost is lost; no number is used twice, and nothing is stated of the way across the gap.
TEST(CutJournal, IsGoneOnWithAfterAnyEntry) {
  const std::vector<Sample>& samples = TheRecording().samples;
  const std::size_t stop = samples.size() / 2;
  Disk whole;
  Process before(&whole);
  for (std::size_t i = 0; i < stop; ++i) before.Feed(samples[i]);
  const std::size_t entries = whole.journal.size();
  const auto next_submap = DecodeCheckpoint(whole.checkpoint)->next_submap;
  ASSERT_GE(next_submap, 5);
  for (std::size_t kept = 0; kept <= entries; ++kept) {
    SCOPED_TRACE(std::to_string(kept) + " of " + std::to_string(entries) + " entries");
    Disk disk = whole;
    disk.journal.resize(kept);
    Process resumed(&disk);
    ASSERT_TRUE(resumed.mapper.Resume(disk.Read(), resumed.load));
    EXPECT_EQ(resumed.mapper.counters().at("journal_entries_unusable"), 0);
    const std::int64_t version = resumed.mapper.graph().version();
    for (std::size_t i = stop; i < stop + 1500; ++i) resumed.Feed(samples[i]);
    resumed.Finish();
    SubmapId last;
    std::int64_t number = 0;
    for (const GraphStep& step : StepsOf(resumed.mapper)) {
      EXPECT_EQ(step.update.version, ++number);
      const SubmapId previous = last;
      for (const GraphVertex& vertex : step.update.vertices) {
        EXPECT_GT(vertex.id, last);
        last = vertex.id;
      }
      const bool is_across = number > version && last != previous && last.value >= next_submap &&
                             previous.value < next_submap - 1;
      for (const GraphEdge& edge : step.update.edges)
        if (is_across && edge.kind == EdgeKind::kDeadReckoning && edge.to == last &&
            edge.from != edge.to) {
          EXPECT_EQ(edge.from, previous);
          EXPECT_LT(edge.information(0, 0), 1e-5) << "of two frames that navigation never related";
        }
    }
    EXPECT_GE(last.value, next_submap);
  }
}

class ResumedMapper : public testing::TestWithParam<int> {};

// One in eight of the drawn moments each, so that they run beside each other.
constexpr int kParts = 8;
constexpr int kMomentsEach = 13;

TEST_P(ResumedMapper, GoesOnInTheSameGraphAfterAnyMessage) {
  const std::vector<Sample>& samples = TheRecording().samples;
  Disk whole_disk;
  Process whole(&whole_disk);
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  std::uniform_int_distribution<std::size_t> moment(400, samples.size() - 1);
  std::set<std::size_t> stops;
  while (stops.size() < kMomentsEach) stops.insert(moment(random));
  std::map<std::size_t, Disk> disks;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    whole.Feed(samples[i]);
    if (stops.contains(i) && !whole_disk.checkpoint.empty()) disks[i] = whole_disk;
  }
  whole.Finish();
  const std::vector<GraphStep> without_stop = StepsOf(whole.mapper);
  ASSERT_GE(whole_disk.clouds.size(), 12U);
  ASSERT_EQ(disks.size(), stops.size());
  ASSERT_GT(whole.mapper.noise().components.closures, 3);
  int resumed_with_closures = 0;

  std::uniform_int_distribution<std::size_t> silence(0, 1500);  // 25 s
  for (auto& [stop, disk] : disks) {
    SCOPED_TRACE("stopped after sample " + std::to_string(stop));
    Process resumed(&disk);
    ASSERT_TRUE(resumed.mapper.Resume(disk.Read(), resumed.load));
    EXPECT_EQ(resumed.mapper.counters().at("journal_entries_unusable"), 0);
    const std::int64_t version = resumed.mapper.graph().version();
    if (version > 0) ExpectSame(resumed.mapper.noise().components, whole.noise_at.at(version));
    resumed_with_closures += resumed.mapper.noise().components.closures > 0;
    for (std::size_t i = stop + 1 + silence(random); i < samples.size(); ++i)
      resumed.Feed(samples[i]);
    resumed.Finish();
    const std::vector<GraphStep> steps = StepsOf(resumed.mapper);
    ASSERT_GE(static_cast<std::int64_t>(steps.size()), version);
    for (std::int64_t v = 0; v < version; ++v)
      EXPECT_EQ(BytesOf(steps[static_cast<std::size_t>(v)]),
                BytesOf(without_stop[static_cast<std::size_t>(v)]));
    ExpectOneWholeGraph(steps, version, disk);
    EXPECT_LE(FixesIn(steps), FixesIn(without_stop));
    if (HasFailure()) return;
  }
  EXPECT_GT(resumed_with_closures, 3);
}
INSTANTIATE_TEST_SUITE_P(Moments, ResumedMapper, testing::Range(0, kParts));

}  // namespace
}  // namespace seastitch
