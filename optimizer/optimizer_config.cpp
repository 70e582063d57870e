#include "optimizer/optimizer_config.hpp"

#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {

ParameterTable TableOf(OptimizerParams* p) {
  ParameterTable table;
  table.Add("inlier_probability",
            &p->inlier_probability,
            Unit::kNone,
            Range::Above(0.5).Below(1.0),
            "Probability with which a correct loop closure or position fix is kept: the quantile "
            "of chi-square, with as many degrees of freedom as the edge measures, that is the "
            "inlier threshold of its squared residual. 0.999 rejects one correct closure in a "
            "thousand where covariances are consistent. Lower it only where wrong closures stay "
            "in the map.");
  table.Add("graduation_step",
            &p->graduation_step,
            Unit::kNone,
            Range::Within(1.1, 100.0),
            "Factor by which graduated non-convexity raises its control parameter mu from one "
            "stage to the next, from nearly squared to truncated losses. A smaller factor is "
            "slower and tolerates more wrong closures.");
  table.Add("max_iterations",
            &p->max_iterations,
            Unit::kNone,
            Range::AtLeast(1),
            "Maximum number of iterations of the minimiser (Ceres) in the last stage. A survey "
            "takes 5 to 30. The limit bounds the time of an ill-conditioned graph. Raise it where "
            "HEALTH says that the solution has not converged.");
  table.Add("unlinked_sigma_m",
            &p->unlinked_sigma_m,
            Unit::kMetre,
            Range::Above(0.0),
            "Default 1 sigma of the relative position of two successive submaps, per axis, where "
            "navigation states no covariance for it. Also the stated sigma of every submap where "
            "the covariances of a solution cannot be computed.");
  table.Add("unlinked_sigma_yaw_deg",
            &p->unlinked_sigma_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::Above(0.0),
            "Default 1 sigma of the relative heading of two successive submaps, used likewise. "
            "Also 1 sigma of the heading of a dive's first submap where navigation states none, "
            "except for the first dive of a graph without position fixes: its heading is held.");
  return table;
}

OptimizerParams LoadOptimizerConfig(const std::string& path) {
  OptimizerParams params;
  LoadParameters(path, TableOf(&params));
  return params;
}

std::string PrintConfig(const OptimizerParams& params) { return PrintWithDefaults(params, {}); }

}  // namespace seastitch
