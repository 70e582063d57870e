#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "common/core/submap.hpp"
#include "products/survey.hpp"
#include "products/survey_collector.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch::testing {

using Seabed = std::function<double(double north, double east)>;  // depth [m]

inline double Hills(double north, double east) {
  return 40.0 + 1.5 * std::sin(north / 7.0) * std::cos(east / 9.0) + 0.03 * north +
         0.4 * std::sin((north + 2.0 * east) / 3.0);
}

constexpr double kAltitude = 12.0;

// What a vehicle 12 m over the seabed sees of a swath `length` x `width` about T_map_true, as a
// submap that believes to be at T_map_believed. Level vehicle; points on a jittered lattice.
inline Submap SeenFrom(int id,
                       const Pose2& T_map_true,
                       const Pose2& T_map_believed,
                       const Seabed& seabed,
                       double length,
                       double width,
                       double spacing,
                       double noise_m) {
  std::mt19937 random(static_cast<unsigned>(id) + 1u);
  const auto jitter = [&random] { return static_cast<double>(random() >> 8) / 16777216.0 - 0.5; };
  const double z = seabed(T_map_true.x, T_map_true.y) - kAltitude;
  Submap submap;
  submap.id.value = id;
  submap.start = FromUtime(1'700'000'000'000'000 + id * 30'000'000LL);
  submap.frame_time = submap.start + FromSeconds(15.0);
  submap.end = submap.start + FromSeconds(30.0);
  submap.T_map_submap = MakePose({T_map_believed.x, T_map_believed.y, z},
                                 RotationFromRpy(0.0, 0.0, T_map_believed.yaw));
  submap.trigger = SubmapTrigger::kLength;
  for (double x = -0.5 * length; x < 0.5 * length; x += spacing) {
    for (double y = -0.5 * width; y < 0.5 * width; y += spacing) {
      const Eigen::Vector2d p_level(x + spacing * jitter(), y + spacing * jitter());
      const Eigen::Vector2d p_map = T_map_true * p_level;
      const double depth = seabed(p_map.x(), p_map.y()) + 3.4641 * noise_m * jitter();
      submap.cloud.Add(Eigen::Vector3d(p_level.x(), p_level.y(), depth - z).cast<float>(), 2.0f);
    }
  }
  submap.soundings_used = 2 * submap.cloud.size();
  submap.soundings_read = submap.soundings_used + 7;
  return submap;
}

// A lawn-mower survey of north-south lines whose dead reckoning drifts, and the true poses.
struct DriftingSurvey {
  std::vector<Submap> submaps;
  std::vector<Pose2> truth;
  std::vector<NavState> track;  // dead reckoned, 2 Hz
  std::vector<NavState> true_track;
};

inline NavState StateAt(Time time, const Pose2& T_map_level) {
  NavState state;
  state.time = time;
  state.T_map_vehicle =
      MakePose({T_map_level.x, T_map_level.y, 28.0}, RotationFromRpy(0.0, 0.0, T_map_level.yaw));
  return state;
}

inline DriftingSurvey MakeDriftingSurvey(int lines = 3, int along = 3, double drift_m = 0.35) {
  DriftingSurvey survey;
  const double length = 24.0, width = 30.0, line_spacing = 22.0;
  Pose2 error;
  for (int line = 0; line < lines; ++line) {
    for (int k = 0; k < along; ++k) {
      const bool north = line % 2 == 0;
      const double x = length * (north ? k + 0.5 : along - k - 0.5);
      const Pose2 truth{x, line_spacing * line, north ? 0.0 : WrapAngle(kPi)};
      const int id = line * along + k;
      const Pose2 believed = error * truth;
      survey.truth.push_back(truth);
      survey.submaps.push_back(SeenFrom(id, truth, believed, Hills, length, width, 0.5, 0.02));
      for (int step = 0; step < 60; ++step) {
        const double ahead = length * (step / 60.0 - 0.5);
        const Time time = survey.submaps.back().start + FromSeconds(0.5 * step);
        survey.track.push_back(StateAt(time, believed * Pose2{ahead, 0.0, 0.0}));
        survey.true_track.push_back(StateAt(time, truth * Pose2{ahead, 0.0, 0.0}));
      }
      error = error * Pose2{drift_m, -0.6 * drift_m, 0.004};
    }
  }
  return survey;
}

inline PoseGraph SolutionAt(const std::vector<Pose2>& poses) {
  PoseGraph graph;
  graph.graph_version = 1;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    SolvedVertex v;
    v.id.value = static_cast<int>(i);
    v.T_map_level = poses[i];
    v.covariance = Eigen::Vector3d(0.04, 0.09, 1e-6).asDiagonal();
    graph.vertices.push_back(v);
  }
  return graph;
}

inline GraphEdge LoopEdge(int from, int to, LoopVerdict verdict = LoopVerdict::kAccepted) {
  GraphEdge edge;
  edge.kind = EdgeKind::kLoopClosure;
  edge.from.value = from;
  edge.to.value = to;
  edge.T_from_to = {1.0, 2.0, 0.1};
  edge.information << 4, 1, 0, 1, 5, 0, 0, 0, 900;
  edge.verdict = verdict;
  edge.z_offset_m = 0.05;
  edge.rms_m = 0.03;
  edge.overlap_m2 = 120.0;
  return edge;
}

inline Survey Collect(const DriftingSurvey& drifting,
                      const std::filesystem::path& dir,
                      const PoseGraph& solution,
                      const std::vector<GraphEdge>& edges) {
  SurveyCollector collector(dir);
  for (const Submap& s : drifting.submaps) collector.Add(s);
  for (const NavState& s : drifting.track) collector.Add(s);
  collector.Add(GraphUpdate{1, {}, edges});
  collector.Add(solution);
  return collector.Finish();
}

}  // namespace seastitch::testing
