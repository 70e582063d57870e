#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "common/core/graph.hpp"

// The graph of a simulated lawn-mower survey with its truth, from a seed: one update a submap.
namespace seastitch {

struct SurveyOptions {
  int vertices = 100;
  int per_line = 10;
  double spacing_m = 40.0;       // along a line
  double line_spacing_m = 30.0;  // between lines
  int closures = 5;              // a vertex, to the nearest earlier vertices of the lines before
  double sigma_m = 0.4;          // of a dead-reckoned step
  double sigma_yaw_rad = 0.003;
  // Share of all closures that are wrong, between any two submaps, and how far off they are.
  double wrong_share = 0.0;
  // 0: between any two. Else to one of so many nearest of the lines before, as an overlap search
  // would have it: the graph stays as sparse as the survey is flat.
  int wrong_among = 0;
  double wrong_min_m = 3.0;
  double wrong_max_m = 15.0;
  double wrong_yaw_rad = 0.1;
  unsigned seed = 1;
};

struct SurveyGraph {
  std::vector<Pose2> truth;
  std::vector<GraphUpdate> updates;
  std::set<std::pair<SubmapId, SubmapId>> wrong;
};

inline Eigen::Matrix3d DiagonalInformation(double sigma_m, double sigma_yaw_rad) {
  const Eigen::Vector3d sigma(sigma_m, sigma_m, sigma_yaw_rad);
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

class SurveySimulator {
 public:
  explicit SurveySimulator(const SurveyOptions& options) : o_(options), random_(options.seed) {}

  SurveyGraph Make() {
    Pose2 dead_reckoned = Truth(0);
    std::size_t honest = 0;
    for (int n = 0; n < o_.vertices; ++n) {
      out_.truth.push_back(Truth(n));
      GraphUpdate update{n + 1, {}, {}};
      if (n > 0) {
        update.edges.push_back(DeadReckoning(n));
        dead_reckoned = dead_reckoned * update.edges[0].T_from_to;
      }
      update.vertices.push_back({SubmapId{n}, Time(Duration(1'000'000 * (n + 1))), dead_reckoned});
      const std::vector<int> neighbours = Neighbours(n, o_.closures);
      for (const int m : neighbours) update.edges.push_back(Closure(m, n, Eigen::Vector3d::Zero()));
      out_.updates.push_back(update);
      honest += neighbours.size();
    }
    AddWrong(
        static_cast<int>(static_cast<double>(honest) * o_.wrong_share / (1.0 - o_.wrong_share)));
    return out_;
  }

 private:
  // On pairs that have no edge. Drawn last: the honest part is that of the survey without.
  void AddWrong(int count) {
    while (static_cast<int>(out_.wrong.size()) < count) {
      const int n = std::uniform_int_distribution<int>(2, o_.vertices - 1)(random_);
      const std::vector<int> honest = Neighbours(n, o_.closures);
      const std::vector<int> near = Neighbours(n, o_.wrong_among);
      if (o_.wrong_among > 0 && near.empty()) continue;
      const int m = near.empty() ? std::uniform_int_distribution<int>(0, n - 2)(random_)
                                 : near[random_() % near.size()];
      const std::pair<SubmapId, SubmapId> pair{SubmapId{m}, SubmapId{n}};
      if (std::find(honest.begin(), honest.end(), m) != honest.end() || out_.wrong.contains(pair))
        continue;
      const double angle = Uniform(-kPi, kPi);
      const double off = Uniform(o_.wrong_min_m, o_.wrong_max_m);
      const double yaw = Uniform(-o_.wrong_yaw_rad, o_.wrong_yaw_rad);
      out_.updates[static_cast<std::size_t>(n)].edges.push_back(
          Closure(m, n, {off * std::cos(angle), off * std::sin(angle), yaw}));
      out_.wrong.insert(pair);
    }
  }

  double Normal(double sigma) { return std::normal_distribution<double>(0.0, sigma)(random_); }
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  Pose2 Truth(int n) const {
    const int line = n / o_.per_line;
    const int along = line % 2 == 0 ? n % o_.per_line : o_.per_line - 1 - n % o_.per_line;
    return {along * o_.spacing_m, line * o_.line_spacing_m, line % 2 == 0 ? 0.0 : -kPi};
  }

  GraphEdge DeadReckoning(int n) {
    GraphEdge edge;
    edge.from = SubmapId{n - 1};
    edge.to = SubmapId{n};
    edge.T_from_to = Inverse(Truth(n - 1)) * Truth(n) *
                     Pose2{Normal(o_.sigma_m), Normal(o_.sigma_m), Normal(o_.sigma_yaw_rad)};
    edge.information = DiagonalInformation(o_.sigma_m, o_.sigma_yaw_rad);
    return edge;
  }

  std::vector<int> Neighbours(int n, int count) const {
    const int line = n / o_.per_line;
    std::vector<int> all;
    for (int m = std::max(0, (line - 2) * o_.per_line); m < line * o_.per_line; ++m)
      all.push_back(m);
    const auto distance = [&](int m) {
      return (Truth(m).Translation() - Truth(n).Translation()).norm();
    };
    std::stable_sort(
        all.begin(), all.end(), [&](int a, int b) { return distance(a) < distance(b); });
    all.resize(std::min(all.size(), static_cast<std::size_t>(count)));
    return all;
  }

  // Known three times better across some direction than along it, as a ridge would have it.
  GraphEdge Closure(int m, int n, const Eigen::Vector3d& offset) {
    GraphEdge edge;
    edge.kind = EdgeKind::kLoopClosure;
    edge.from = SubmapId{m};
    edge.to = SubmapId{n};
    const Eigen::Vector3d sigma(0.1, 0.3, 0.01);
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    axes.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(Uniform(0.0, kPi)).toRotationMatrix();
    edge.information = axes * sigma.cwiseAbs2().cwiseInverse().asDiagonal() * axes.transpose();
    // One after the other: compilers evaluate arguments in different orders.
    Eigen::Vector3d along;
    for (int axis = 2; axis >= 0; --axis) along[axis] = Normal(sigma[axis]);
    const Eigen::Vector3d error = axes * along + offset;
    const Pose2 T = Inverse(Truth(m)) * Truth(n);
    edge.T_from_to = {T.x + error.x(), T.y + error.y(), WrapAngle(T.yaw + error.z())};
    return edge;
  }

  const SurveyOptions o_;
  std::mt19937_64 random_;
  SurveyGraph out_;
};

inline SurveyGraph SimulateSurvey(const SurveyOptions& options) {
  return SurveySimulator(options).Make();
}

}  // namespace seastitch
