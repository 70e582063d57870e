#include "tests/perf/pcl_gicp.hpp"

#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>

namespace seastitch {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

struct PclGicp::Clouds {
  Cloud::Ptr target = std::make_shared<Cloud>();
  Cloud::Ptr source = std::make_shared<Cloud>();
};

PclGicp::PclGicp(const PointCloud& target, const PointCloud& source, double max_correspondence_m)
    : clouds_(std::make_unique<Clouds>()), max_correspondence_m_(max_correspondence_m) {
  for (const auto& [from, to] :
       {std::pair{&target, clouds_->target}, std::pair{&source, clouds_->source}})
    for (const Eigen::Vector3f& p : from->points) to->emplace_back(p.x(), p.y(), p.z());
}

PclGicp::~PclGicp() = default;

Eigen::Isometry3d PclGicp::Align(const Eigen::Isometry3d& T_prior) const {
  pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> gicp;
  gicp.setInputTarget(clouds_->target);
  gicp.setInputSource(clouds_->source);
  gicp.setMaxCorrespondenceDistance(max_correspondence_m_);
  Cloud aligned;
  gicp.align(aligned, T_prior.matrix().cast<float>());
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.matrix() = gicp.getFinalTransformation().cast<double>();
  return T;
}

}  // namespace seastitch
