// A Mapper that is stopped and resumed, with sensors that err as their parameters state: the edges
// across and after the restart are as uncertain as the graph says.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "mapper/mapper.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

namespace seastitch {
namespace {

constexpr double kImuHz = 50.0;
constexpr double kSeabedM = 35.0;

MapperParams Params() {
  MapperParams params;
  params.vehicle = test::TestVehicle();
  params.submap.max_duration_s = 12.0;
  params.loop_closer.overlap.max_pairs = 0;  // dead reckoning alone
  params.sound_velocity_profile = SoundVelocityProfile{{}, {0.0, 100.0}, {1500.0, 1500.0}};
  return params;
}

// Echoes of a level seabed.
MbesPing PingOf(const test::TruthState& truth) {
  MbesPing ping;
  ping.time = test::At(truth.t);
  ping.sound_speed_mps = 1500.0;
  for (int b = -30; b <= 30; ++b) {
    const double angle = Deg2Rad(2.0 * b);
    const Eigen::Vector3d beam =
        truth.T_map_vehicle.linear() * Eigen::Vector3d(0.0, std::sin(angle), std::cos(angle));
    MbesBeam echo;
    echo.twtt_s = static_cast<float>(2.0 * (kSeabedM - truth.T_map_vehicle.translation().z()) /
                                     beam.z() / 1500.0);
    echo.rx_angle_rad = static_cast<float>(angle);
    echo.flags = kBeamValid;
    ping.beams.push_back(echo);
  }
  return ping;
}

const std::vector<test::TruthState>& TheTruth() {
  static const std::vector<test::TruthState> truth =
      test::Truth(test::LawnMower(100.0, 3), test::TestVehicle(), 300.0, kImuHz);
  return truth;
}

// One dive: the graph's dead-reckoning edges, and the frames of its submaps.
class Dive {
 public:
  explicit Dive(std::uint32_t seed)
      : params_(Params()), sensors_(params_.navigation, kImuHz, seed), random_(seed) {
    mapper_ = std::make_unique<Mapper>(params_);
    const double stop_s = std::uniform_real_distribution(100.0, 200.0)(random_);
    const double resume_s = stop_s + std::uniform_real_distribution(1.0, 20.0)(random_);
    bool is_down = false;
    for (std::size_t i = 0; i < TheTruth().size(); ++i) {
      const test::TruthState& truth = TheTruth()[i];
      if (!is_down && truth.t > stop_s && truth.t < resume_s) {
        saved_.checkpoint = *mapper_->MakeCheckpoint();
        is_down = true;
      }
      if (is_down && truth.t >= resume_s) {
        is_down = false;
        first_after_ = saved_.checkpoint.next_submap;
        mapper_ = std::make_unique<Mapper>(params_);
        EXPECT_TRUE(mapper_->Resume(saved_, [](SubmapId) { return nullptr; }));
      }
      Measure(i, is_down);
    }
    mapper_->Finish();
    Take();
  }

  // (error, information) of each edge but the one across the restart, and that one.
  std::vector<double> nees;
  std::optional<double> nees_across;

 private:
  // The sensors go on while the mapper is down.
  void Measure(std::size_t i, bool is_down) {
    const test::TruthState& truth = TheTruth()[i];
    const ImuSample imu = sensors_.Imu(truth);
    if (!is_down) mapper_->Add(imu);
    if (i % 10 == 0) {
      const DepthSample depth = sensors_.Depth(truth);
      const DvlSample dvl = sensors_.Dvl(truth);
      if (!is_down) mapper_->Add(depth);
      if (!is_down) mapper_->Add(dvl);
    }
    if (i % 12 == 0 && !is_down) mapper_->Add(PingOf(truth));
    if (!is_down) Take();
  }
  void Take() {
    while (true) {
      for (const MapperEvent& event : mapper_->TakeEvents()) {
        if (const auto* entry = std::get_if<JournalEntry>(&event)) saved_.journal.push_back(*entry);
        if (const auto* step = std::get_if<GraphStep>(&event)) Judge(step->update);
      }
      const std::optional<RegistrationJob> job = mapper_->NextJob();
      if (!job) return;
      mapper_->Take(Run(
          *job, params_.loop_closer, [](SubmapId) { return nullptr; }, nullptr));
    }
  }
  void Judge(const GraphUpdate& update) {
    for (const GraphVertex& vertex : update.vertices) {
      const double t = ToSeconds(vertex.time - test::At(0.0));
      const auto i = static_cast<std::size_t>(std::lround(t * kImuHz));
      truth_[vertex.id] = LevelPose(TheTruth()[i].T_map_vehicle);
    }
    for (const GraphEdge& edge : update.edges) {
      if (edge.kind != EdgeKind::kDeadReckoning || edge.from == edge.to) continue;
      const Pose2 is = Inverse(truth_.at(edge.from)) * truth_.at(edge.to);
      Eigen::Vector3d error = edge.T_from_to.Vector() - is.Vector();
      error.z() = WrapAngle(error.z());
      const double square = error.dot(edge.information * error);
      if (first_after_ && edge.from.value < *first_after_ && edge.to.value >= *first_after_)
        nees_across = square;
      else
        nees.push_back(square);
    }
  }

  const MapperParams params_;
  test::Sensors sensors_;
  std::mt19937 random_;
  std::unique_ptr<Mapper> mapper_;
  SavedMap saved_;
  std::optional<std::int32_t> first_after_;
  std::map<SubmapId, Pose2> truth_;
};

double Mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST(NoisyResume, StatesTheErrorsOfItsEdges) {
  constexpr int kDives = 16;
  std::vector<double> nees;
  std::vector<double> across;
  for (std::uint32_t seed = 0; seed < kDives; ++seed) {
    const Dive dive(seed);
    nees.insert(nees.end(), dive.nees.begin(), dive.nees.end());
    ASSERT_TRUE(dive.nees_across) << seed;
    across.push_back(*dive.nees_across);
  }
  std::printf("%zu edges: %.2f, across the restart: %.2f\n", nees.size(), Mean(nees), Mean(across));
  ASSERT_GT(nees.size(), 150U);
  // Of three degrees of freedom.
  EXPECT_GT(Mean(nees), 1.5);
  EXPECT_LT(Mean(nees), 4.5);
  EXPECT_GT(Mean(across), 0.05);
  EXPECT_LT(Mean(across), 5.0);
}

}  // namespace
}  // namespace seastitch
