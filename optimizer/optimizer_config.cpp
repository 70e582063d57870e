#include "optimizer/optimizer_config.hpp"

namespace seastitch {

ParameterTable TableOf(OptimizerParams* p) {
  ParameterTable table;
  table.Add("inlier_probability",
            &p->inlier_probability,
            Unit::kNone,
            Range::Above(0.5).Below(1.0),
            "A loop closure or position fix is an inlier within this quantile of chi-square of the "
            "solution. 0.999 loses one true closure in a thousand.");
  table.Add("graduation_step",
            &p->graduation_step,
            Unit::kNone,
            Range::Within(1.1, 100.0),
            "How fast the robust loss is sharpened from plain squares to truncated ones, as the "
            "factor between two solves. Smaller is slower and copes with more wrong closures.");
  table.Add(
      "max_iterations",
      &p->max_iterations,
      Unit::kNone,
      Range::AtLeast(1),
      "Iterations of the minimiser (Ceres) in the last stage. A survey takes 5 to 30; the limit "
      "keeps a broken graph from holding the process up.");
  table.Add("unlinked_sigma_m",
            &p->unlinked_sigma_m,
            Unit::kMetre,
            Range::Above(0.0),
            "How far a submap may be from where dead reckoning puts it after its predecessor where "
            "navigation gives no uncertainty for that step, 1 sigma.");
  table.Add("unlinked_sigma_yaw_deg",
            &p->unlinked_sigma_yaw_rad,
            Unit::kDegreeFromRadian,
            Range::Above(0.0),
            "The same of its heading, and of the first submap's where there are position fixes and "
            "navigation gives no uncertainty for it.");
  return table;
}

OptimizerParams LoadOptimizerConfig(const std::string& path) {
  OptimizerParams params;
  TableOf(&params).Load(path);
  return params;
}

std::string PrintConfig(const OptimizerParams& params) { return PrintWithDefaults(params, {}); }

}  // namespace seastitch
