#include "optimizer/optimizer_config.hpp"

namespace seastitch {

ParameterTable TableOf(OptimizerParams* p) {
  ParameterTable table;
  table.Add("inlier_probability",
            &p->inlier_probability,
            Unit::kNone,
            Range::Above(0.5).Below(1.0),
            "Quantile of chi-square within which the residual of a loop closure or position "
            "fix is an inlier. 0.999 loses one true closure in a thousand.");
  table.Add("graduation_step",
            &p->graduation_step,
            Unit::kNone,
            Range::Within(1.1, 100.0),
            "Factor by which the robust loss is sharpened from one stage to the next, from "
            "plain squares to truncated ones. A smaller factor is slower and copes with more "
            "wrong closures.");
  table.Add("max_iterations",
            &p->max_iterations,
            Unit::kNone,
            Range::AtLeast(1),
            "Most iterations of the minimiser (Ceres) in the last stage. A survey takes 5 to "
            "30. The limit bounds the time that a defective graph may cost.");
  table.Add("unlinked_sigma_m",
            &p->unlinked_sigma_m,
            Unit::kMetre,
            Range::Above(0.0),
            "Sigma of the step from one submap to the next, each axis, where navigation gives "
            "no uncertainty for it.");
  table.Add("unlinked_sigma_yaw_deg",
            &p->unlinked_sigma_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::Above(0.0),
            "The same for the heading; also for that of the first submap where there are "
            "position fixes and navigation gives no uncertainty for it.");
  return table;
}

OptimizerParams LoadOptimizerConfig(const std::string& path) {
  OptimizerParams params;
  TableOf(&params).Load(path);
  return params;
}

std::string PrintConfig(const OptimizerParams& params) { return PrintWithDefaults(params, {}); }

}  // namespace seastitch
