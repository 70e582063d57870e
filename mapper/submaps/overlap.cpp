#include "mapper/submaps/overlap.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/multi_polygon.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>

#include "mapper/submaps/eigenvalues.hpp"
#include "mapper/submaps/footprint.hpp"

namespace seastitch {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point>;
using MultiPolygon = bg::model::multi_polygon<Polygon>;

// The footprint in frame a, given in frame b.
Polygon PolygonOf(const Footprint& footprint, const Pose2& T_a_b) {
  Polygon polygon;
  for (const Eigen::Vector2d& corner : footprint) {
    const Eigen::Vector2d p = T_a_b * corner;
    bg::append(polygon.outer(), Point(p.x(), p.y()));
  }
  bg::correct(polygon);
  return polygon;
}

// The box around a footprint in frame a, given in frame b.
Eigen::AlignedBox2d BoxOf(const Footprint& footprint, const Pose2& T_a_b) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : footprint) box.extend(T_a_b * corner);
  return box;
}

double CommonArea(const Polygon& a, const Polygon& b) {
  try {
    MultiPolygon common;
    bg::intersection(a, b, common);
    return bg::area(common);
  } catch (const bg::exception&) {
    return 0.0;  // for an imported outline that crosses itself
  }
}

// A point at which the error ellipse of x, y is sampled, relative to its centre, and its weight.
struct Node {
  Eigen::Vector2d offset;
  double weight;
};

std::array<Node, 9> Quadrature(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);
  const Eigen::Vector2d sigma = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const double at[3] = {-std::sqrt(3.0), 0.0, std::sqrt(3.0)};
  const double weight[3] = {1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0};
  std::array<Node, 9> nodes;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      nodes[3 * i + j] = {
          solver.eigenvectors() * Eigen::Vector2d(at[i] * sigma.x(), at[j] * sigma.y()),
          weight[i] * weight[j]};
    }
  }
  return nodes;
}

bool CanMeet(const SubmapOutline& target, const SubmapOutline& source, const RelativePose& prior) {
  // Twice the square root of the trace is at least two sigma in any direction: more than any node.
  const double reach = 2.0 * std::sqrt(prior.covariance.topLeftCorner<2, 2>().trace());
  return prior.T_a_b.Translation().norm() <= target.radius_m + source.radius_m + reach;
}

// Predicted information of the pair's registration, about the source's origin in the target's axes:
// that of the source, rotated and scaled to the overlap, limited to that of the target.
Eigen::Matrix3d PairInformation(const SubmapOutline& target,
                                const SubmapOutline& source,
                                const RelativePose& prior,
                                double part_of_source) {
  const double in_source =
      source.predicted_information.topLeftCorner<2, 2>().trace() / source.area_m2;
  const double in_target =
      target.predicted_information.topLeftCorner<2, 2>().trace() / target.area_m2;
  if (!(in_source > 0.0)) return Eigen::Matrix3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  R.topLeftCorner<2, 2>() = prior.T_a_b.Rotation();
  return part_of_source * std::min(1.0, in_target / in_source) * R * source.predicted_information *
         R.transpose();
}

}  // namespace

SubmapOutline OutlineOf(const Submap& submap) {
  SubmapOutline outline{submap.id,
                        submap.footprint,
                        Area(submap.footprint),
                        0.0,
                        submap.predicted_information.value_or(Eigen::Matrix3d::Zero())};
  for (const Eigen::Vector2d& corner : submap.footprint) {
    outline.radius_m = std::max(outline.radius_m, corner.norm());
  }
  return outline;
}

double OverlapArea(const Footprint& a, const Footprint& b, const Pose2& T_a_b) {
  if (a.size() < 3 || b.size() < 3) return 0.0;
  return CommonArea(PolygonOf(a, {}), PolygonOf(b, T_a_b));
}

double ExpectedOverlapArea(const Footprint& target,
                           const Footprint& source,
                           const RelativePose& prior) {
  if (target.size() < 3 || source.size() < 3) return 0.0;
  const Polygon fixed = PolygonOf(target, {});
  const Eigen::AlignedBox2d fixed_box = BoxOf(target, {});
  double expected = 0.0;
  for (const Node& node : Quadrature(prior.covariance.topLeftCorner<2, 2>())) {
    Pose2 T = prior.T_a_b;
    T.x += node.offset.x();
    T.y += node.offset.y();
    if (!fixed_box.intersects(BoxOf(source, T))) continue;
    expected += node.weight * CommonArea(fixed, PolygonOf(source, T));
  }
  return expected;
}

OverlapCandidate JudgePair(const SubmapOutline& target,
                           const SubmapOutline& source,
                           const RelativePose& prior,
                           double expected_overlap_part) {
  OverlapCandidate candidate{target.id, prior, 0.0, 0.0, 0.0};
  const double smaller_m2 = std::min(target.area_m2, source.area_m2);
  if (!(smaller_m2 > 0.0) || !prior.covariance.allFinite() || !CanMeet(target, source, prior))
    return candidate;
  candidate.overlap_m2 = ExpectedOverlapArea(target.footprint, source.footprint, prior);
  candidate.overlap_part = candidate.overlap_m2 / smaller_m2;
  const double part_of_source = candidate.overlap_m2 / source.area_m2 / expected_overlap_part;
  const Eigen::Matrix3d information = PairInformation(target, source, prior, part_of_source);
  const double determinant =
      (Eigen::Matrix3d::Identity() + prior.covariance * information).determinant();
  candidate.gain_nats = determinant > 1.0 ? 0.5 * std::log(determinant) : 0.0;
  return candidate;
}

std::vector<OverlapCandidate> ChoosePairs(std::vector<OverlapCandidate> candidates,
                                          const OverlapParams& params) {
  std::erase_if(candidates, [&](const OverlapCandidate& c) {
    return c.overlap_m2 < params.min_overlap_m2 || c.overlap_part < params.min_overlap_fraction;
  });
  std::sort(candidates.begin(),
            candidates.end(),
            [](const OverlapCandidate& a, const OverlapCandidate& b) {
              if (a.gain_nats != b.gain_nats) return a.gain_nats > b.gain_nats;
              if (a.overlap_m2 != b.overlap_m2) return a.overlap_m2 > b.overlap_m2;
              return a.target < b.target;
            });
  if (candidates.size() > static_cast<std::size_t>(params.max_pairs)) {
    candidates.resize(static_cast<std::size_t>(params.max_pairs));
  }
  return candidates;
}

}  // namespace seastitch
