#include "mapper/registration/gicp.hpp"

#include <pcl/filters/voxel_grid.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace seastitch {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Eigen::Vector3d Position(const pcl::PointXYZ& p) { return p.getVector3fMap().cast<double>(); }

// Covariance of the points around points[at], with the eigenvalues replaced by 1, 1, epsilon.
Eigen::Matrix3d PlaneCovariance(const Cloud& points,
                                const pcl::KdTreeFLANN<pcl::PointXYZ>& tree,
                                int at,
                                const GicpParams& params) {
  std::vector<int> nearest;
  std::vector<float> squared_m;
  tree.nearestKSearch(at, params.neighbours, nearest, squared_m);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int i : nearest) mean += Position(points[static_cast<std::size_t>(i)]);
  mean /= static_cast<double>(nearest.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const int i : nearest) {
    const Eigen::Vector3d d = Position(points[static_cast<std::size_t>(i)]) - mean;
    scatter += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  const Eigen::Vector3d normal = eigen.eigenvectors().col(0);  // direction of least scatter
  return Eigen::Matrix3d::Identity() - (1.0 - params.epsilon) * normal * normal.transpose();
}

}  // namespace

struct GicpSubmap::Points {
  Cloud::Ptr cloud = std::make_shared<Cloud>();
  std::vector<Eigen::Matrix3d> covariances;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
};

GicpSubmap::GicpSubmap(const PointCloud& cloud,
                       const Eigen::Matrix3d& R_level_submap,
                       const GicpParams& params)
    : points_(std::make_unique<Points>()) {
  const auto level = std::make_shared<Cloud>();
  const Eigen::Matrix3f R = R_level_submap.cast<float>();
  for (const Eigen::Vector3f& p : cloud.points) {
    if (!p.allFinite()) continue;
    pcl::PointXYZ point;
    point.getVector3fMap() = R * p;
    level->push_back(point);
  }
  if (level->empty()) return;
  pcl::VoxelGrid<pcl::PointXYZ> thin;
  thin.setInputCloud(level);
  const auto leaf_m = static_cast<float>(params.voxel_m);
  thin.setLeafSize(leaf_m, leaf_m, leaf_m);
  thin.filter(*points_->cloud);
  points_->tree.setInputCloud(points_->cloud);
  for (std::size_t i = 0; i < points_->cloud->size(); ++i) {
    points_->covariances.push_back(
        PlaneCovariance(*points_->cloud, points_->tree, static_cast<int>(i), params));
  }
}

GicpSubmap::~GicpSubmap() = default;
GicpSubmap::GicpSubmap(GicpSubmap&&) noexcept = default;
GicpSubmap& GicpSubmap::operator=(GicpSubmap&&) noexcept = default;

namespace {

constexpr int kMinPartners = 20;
// Smaller steps have no meaning, because partners change from step to step.
constexpr double kStepVoxels = 0.01;
constexpr double kStepRad = 2e-4;
// Steps per search distance. Then the distance is halved; at the shortest, the result has not
// converged.
constexpr int kMaxSteps = 20;

// Normal equations and statistics of a hypothesis.
struct Linearised {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  // of x, y, yaw
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_sum = Eigen::Matrix3d::Zero();
  Eigen::Vector2d place_sum_m = Eigen::Vector2d::Zero();
  double dz_sum_m = 0.0;
  double dz_squared_sum_m2 = 0.0;
  int partners = 0;
};

struct GicpFit {
  Pose2 T_target_source;
  Linearised at;  // at the start of its last step
  bool converged = false;
};

class Gicp {
 public:
  Gicp(const GicpSubmap::Points& target,
       const GicpSubmap::Points& source,
       double z_m,
       double voxel_m)
      : target_(target), source_(source), z_m_(z_m), voxel_m_(voxel_m) {}

  // Aligns with partners within max_distance_m, then within half of it, and so on.
  GicpFit Align(const Pose2& T_prior, double max_distance_m) const {
    const double least_m = 2.0 * voxel_m_;
    GicpFit fit{T_prior, {}, false};
    for (double distance_m = std::max(max_distance_m, least_m);; distance_m *= 0.5) {
      fit.converged = Settle(std::max(distance_m, least_m), &fit);
      if (distance_m <= least_m) return fit;
    }
  }

 private:
  // Gauss-Newton steps with partners within one distance. False if they do not converge.
  bool Settle(double max_distance_m, GicpFit* fit) const {
    Pose2& T = fit->T_target_source;
    for (int i = 0; i < kMaxSteps; ++i) {
      fit->at = LineariseAt(T, max_distance_m);
      if (fit->at.partners < kMinPartners) return false;
      const Eigen::Vector3d step = -fit->at.H.ldlt().solve(fit->at.g);
      if (!step.allFinite()) return false;
      T = {T.x + step.x(), T.y + step.y(), WrapAngle(T.yaw + step.z())};
      if (step.head<2>().norm() < kStepVoxels * voxel_m_ && std::abs(step.z()) < kStepRad)
        return true;
    }
    return false;
  }

  // With d = b - (R a + t) for each source point a and its nearest target point b, and M = (C_b + R
  // C_a R^T)^-1 held constant: sum of d^T M d, with its gradient and Gauss-Newton Hessian by t_x,
  // t_y and yaw.
  Linearised LineariseAt(const Pose2& T, double max_distance_m) const {
    Linearised out;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    R.topLeftCorner<2, 2>() = T.Rotation();
    const Eigen::Vector3d t(T.x, T.y, z_m_);
    std::vector<int> nearest(1);
    std::vector<float> squared_m(1);
    for (std::size_t i = 0; i < source_.cloud->size(); ++i) {
      const Eigen::Vector3d turned = R * Position((*source_.cloud)[i]);
      pcl::PointXYZ moved;
      moved.getVector3fMap() = (turned + t).cast<float>();
      if (target_.tree.nearestKSearch(moved, 1, nearest, squared_m) < 1 ||
          !(squared_m[0] <= max_distance_m * max_distance_m))
        continue;
      const auto k = static_cast<std::size_t>(nearest[0]);
      const Eigen::Vector3d d = Position((*target_.cloud)[k]) - (turned + t);
      const Eigen::Matrix3d C = target_.covariances[k] + R * source_.covariances[i] * R.transpose();
      Eigen::Matrix3d J = Eigen::Matrix3d::Zero();  // derivative of R a + t
      J(0, 0) = J(1, 1) = 1.0;
      J(0, 2) = -turned.y();
      J(1, 2) = turned.x();
      const Eigen::Matrix3d MJ = C.ldlt().solve(J);
      out.H += J.transpose() * MJ;
      out.g -= MJ.transpose() * d;
      out.covariance_sum += C;
      out.place_sum_m += (turned + t).head<2>();
      out.dz_sum_m += d.z();
      out.dz_squared_sum_m2 += d.z() * d.z();
      ++out.partners;
    }
    return out;
  }

  const GicpSubmap::Points& target_;
  const GicpSubmap::Points& source_;
  double z_m_;
  double voxel_m_;
};

bool IsCovariance(const Eigen::Matrix3d& C) {
  return C.allFinite() && C.llt().info() == Eigen::Success;
}

Eigen::Matrix3d InformationOf(const Linearised& at, double yaw_information) {
  const Eigen::Matrix2d mean = at.covariance_sum.topLeftCorner<2, 2>() / at.partners;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  information.topLeftCorner<2, 2>() = mean.inverse();
  information(2, 2) = yaw_information;
  return information;
}

}  // namespace

RegistrationResult RegisterGicp(const GicpSubmap& target,
                                const GicpSubmap& source,
                                const RegistrationPrior& prior,
                                const GicpParams& gicp,
                                const RegistrationParams& params) {
  RegistrationResult result;
  result.T_target_source = prior.T_target_source;
  if (!prior.T_target_source.Vector().allFinite() || !std::isfinite(prior.z_m) ||
      !IsCovariance(prior.covariance))
    return result;
  result.verdict = LoopVerdict::kLittleOverlap;
  if (target.points().covariances.empty() || source.points().covariances.empty()) return result;
  const double reach_m =
      params.window_sigma * std::sqrt(prior.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
  const Gicp problem(target.points(), source.points(), prior.z_m, gicp.voxel_m);
  const auto [T, at, converged] = problem.Align(prior.T_target_source, reach_m);
  result.T_target_source = T;
  result.modes = 1;
  result.cell_m = gicp.voxel_m;
  result.overlap_m2 = at.partners * gicp.voxel_m * gicp.voxel_m;
  if (at.partners < kMinPartners || !(result.overlap_m2 >= params.min_overlap_m2)) return result;
  result.overlap_center_m = at.place_sum_m / at.partners;
  const double dz_m = at.dz_sum_m / at.partners;
  result.z_offset_m = -dz_m;
  result.rms_m = std::sqrt(std::max(0.0, at.dz_squared_sum_m2 / at.partners - dz_m * dz_m));
  result.verdict = LoopVerdict::kNotConverged;
  if (!converged) return result;
  Eigen::Vector3d moved = T.Vector() - prior.T_target_source.Vector();
  moved[2] = WrapAngle(moved[2]);
  result.verdict = LoopVerdict::kOutsideWindow;
  if (!(moved.dot(prior.covariance.ldlt().solve(moved)) <= params.max_prior_chi2)) return result;
  result.verdict = LoopVerdict::kAccepted;
  result.information = InformationOf(at, gicp.yaw_information);
  result.known_directions = 3;
  return result;
}

}  // namespace seastitch
