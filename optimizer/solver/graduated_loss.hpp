#pragma once

#include <cmath>
#include <limits>

namespace seastitch {

// Robust loss of graduated non-convexity (GNC): the surrogate of truncated least squares in Yang,
// Antonante, Tzoumas, Carlone, "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020,
// section IV-B. A function of s = |W e|^2, the squared whitened residual, which has no unit:
//   s                                        for s <= mu / (mu + 1) c2      weight 1
//   2 sqrt(c2 s mu (mu + 1)) - mu (c2 + s)   between                        falling to 0
//   c2                                       for s >= (mu + 1) / mu c2      weight 0
// mu > 0 is the control parameter: nearly convex for small mu, truncated least squares for large
// mu. SolveRobustly() raises it from stage to stage. Unlike the Geman-McClure loss it leaves an
// inlier its full weight.
struct GraduatedLoss {
  // Inlier threshold on s, a quantile of chi-square (c-bar squared in the paper). Infinite: plain
  // squares at every stage.
  double c2 = std::numeric_limits<double>::infinity();

  // mu of the last stage. Its weight falls gradually, so that the solution does not jump when one
  // more submap moves a residual across the threshold.
  static constexpr double kFinalMu = 2.0;

  // Largest s with weight 1.
  double FullUpTo(double mu) const { return mu / (mu + 1.0) * c2; }
  // Smallest s with weight 0.
  double NothingFrom(double mu) const { return (mu + 1.0) / mu * c2; }

  // The loss of s.
  double Value(double s, double mu) const {
    if (s <= FullUpTo(mu)) return s;
    if (s >= NothingFrom(mu)) return c2;
    return 2.0 * std::sqrt(c2 * s * mu * (mu + 1.0)) - mu * (c2 + s);
  }
  // Its derivative with respect to s: the inlier weight, 0 to 1.
  double Weight(double s, double mu) const {
    if (s <= FullUpTo(mu)) return 1.0;
    if (s >= NothingFrom(mu)) return 0.0;
    return std::sqrt(c2 * mu * (mu + 1.0) / s) - mu;
  }
};

}  // namespace seastitch
