#include "optimizer/optimizer_config.hpp"

#include "common/runtime/config.hpp"

namespace seastitch {
namespace {

void ReadDegrees(ConfigMap* map, const std::string& key, double* rad) {
  double deg = Rad2Deg(*rad);
  map->Read(key, &deg);
  *rad = Deg2Rad(deg);
}

}  // namespace

OptimizerConfig LoadOptimizerConfig(const std::string& path) {
  OptimizerConfig config;
  OptimizerParams& p = config.params;
  ConfigMap root = ConfigMap::Load(path);
  root.Read("inlier_probability", &p.inlier_probability);
  root.Read("graduation_step", &p.graduation_step);
  root.Read("max_iterations", &p.max_iterations);
  root.Read("unlinked_sigma_m", &p.unlinked_sigma_m);
  ReadDegrees(&root, "unlinked_sigma_yaw_deg", &p.unlinked_sigma_yaw_rad);
  root.Finish();
  root.Check(p.Validate());
  return config;
}

}  // namespace seastitch
