#include "optimizer/solver/closure_prior.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

// Quantile of chi-square at 2 sigma, 0.9545, by degrees of freedom.
constexpr std::array<double, 4> kTwoSigma{0.0, 4.0, 6.18, 8.02};

// A vertex by dead reckoning from a base: errors in map axes.
struct Reckoned {
  SubmapId base;
  Pose2 T_map_vertex;
  Eigen::Matrix3d by_base = Eigen::Matrix3d::Identity();  // its change with that of the base
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();   // of dead reckoning alone
};

Pose2 SolvedOr(const StoredVertex& vertex) { return vertex.solved.value_or(vertex.dead_reckoned); }

MountingErrors MountingOf(std::int32_t chain, const LastSolution& last) {
  const auto found = last.mounting.find(chain);
  if (found == last.mounting.end()) return {};
  return {found->second.Translation(), found->second.yaw};
}

// The measurement as it is by the solution's mounting errors.
Pose2 MeasurementOf(const GraphEdge& edge, const LastSolution& last) {
  const std::int32_t from = last.store.vertices().at(edge.from).chain;
  const std::int32_t to = last.store.vertices().at(edge.to).chain;
  const EdgeByMounting by = ByMounting(edge, from == to);
  const double newest_rad = last.store.newest_dvl_yaw_rad(to).value_or(edge.dvl_yaw_rad);
  const Eigen::Vector3d measured =
      MeasuredBy(newest_rad, edge, by).Vector() +
      MountingCorrection(by, MountingOf(from, last), MountingOf(to, last));
  return {measured.x(), measured.y(), measured.z()};
}

// From the last vertex before it that is solved, or from `other`. Nothing where a step is missing.
std::optional<Reckoned> Reckon(SubmapId id, SubmapId other, const LastSolution& last) {
  const GraphStore& store = last.store;
  const auto& vertices = store.vertices();
  auto base = vertices.find(id);
  std::vector<std::pair<SubmapId, SubmapId>> steps;
  while (!base->second.solved && base->first != other) {
    if (base == vertices.begin()) return std::nullopt;
    const auto before = std::prev(base);
    steps.emplace_back(before->first, base->first);
    base = before;
  }
  Reckoned at{base->first, SolvedOr(base->second)};
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    const auto edge = store.dead_reckoning().find(*step);
    if (edge == store.dead_reckoning().end() || edge->second.root.rank < 3) return std::nullopt;
    const Pose2 T = MeasurementOf(edge->second.edge, last);
    const Eigen::Matrix2d R = Eigen::Rotation2Dd(at.T_map_vertex.yaw).toRotationMatrix();
    const Eigen::Vector2d moved = R * T.Translation();
    Eigen::Matrix3d by_before = Eigen::Matrix3d::Identity();
    by_before(0, 2) = -moved.y();
    by_before(1, 2) = moved.x();
    Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
    turned.topLeftCorner<2, 2>() = R;
    at.T_map_vertex = at.T_map_vertex * T;
    at.by_base = by_before * at.by_base;
    at.covariance = by_before * at.covariance * by_before.transpose() +
                    turned * edge->second.edge.information.inverse() * turned.transpose();
  }
  return at;
}

}  // namespace

std::optional<double> InnovationOf(const StoredEdge& closure, const LastSolution& last) {
  const auto [a, b] = std::minmax(closure.edge.from, closure.edge.to);
  if (!last.covariance) return std::nullopt;
  const std::optional<Reckoned> later = Reckon(b, a, last);
  if (!later) return std::nullopt;
  Reckoned earlier{a, SolvedOr(last.store.vertices().at(a))};
  Eigen::Matrix3d of_earlier = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d of_later = later->covariance;
  Eigen::Matrix3d of_both = Eigen::Matrix3d::Zero();
  if (later->base != a) {
    const auto reckoned = Reckon(a, b, last);
    if (!reckoned) return std::nullopt;
    earlier = *reckoned;
    const auto i = last.number.find(earlier.base), j = last.number.find(later->base);
    if (i == last.number.end() || j == last.number.end()) return std::nullopt;
    GraphCovariance::Pairs between(*last.covariance);
    of_earlier = earlier.by_base * between(i->second, i->second) * earlier.by_base.transpose() +
                 earlier.covariance;
    of_later += later->by_base * between(j->second, j->second) * later->by_base.transpose();
    of_both = earlier.by_base * between(i->second, j->second) * later->by_base.transpose();
  }
  Pose2 from = earlier.T_map_vertex, to = later->T_map_vertex;
  if (closure.edge.from != a) {
    std::swap(from, to);
    std::swap(of_earlier, of_later);
    of_both.transposeInPlace();
  }
  const Eigen::Matrix3d covariance = RelativeCovariance(from, to, of_earlier, of_later, of_both);
  Eigen::Vector3d off = MeasurementOf(closure.edge, last).Vector() - (Inverse(from) * to).Vector();
  off.z() = WrapAngle(off.z());
  const Eigen::Matrix3d& W = closure.root.W;
  const Eigen::Vector3d whitened = W * off;
  const Eigen::Matrix3d expected = W * covariance * W.transpose() + Eigen::Matrix3d::Identity();
  return whitened.dot(expected.ldlt().solve(whitened));
}

bool IsBeyondPrior(const StoredEdge& closure, const LastSolution& last) {
  const std::optional<double> squared = InnovationOf(closure, last);
  return !squared || !(*squared <= kTwoSigma[static_cast<std::size_t>(closure.root.rank)]);
}

}  // namespace seastitch
