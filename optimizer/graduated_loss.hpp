#pragma once

#include <cmath>
#include <limits>

namespace seastitch {

// The surrogate of truncated least squares that graduated non-convexity anneals (Yang, Antonante,
// Tzoumas, Carlone, "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020, section
// IV-B), over s = squared residual, with the threshold c2 on s:
//   s                                        for s <= mu / (mu + 1) c2      weight 1
//   2 sqrt(c2 s mu (mu + 1)) - mu (c2 + s)   between                        falling to 0
//   c2                                       for s >= (mu + 1) / mu c2      weight 0
// Nearly convex for small mu, truncated least squares for large mu. Unlike Geman-McClure it leaves
// an honest edge its full weight.
struct GraduatedLoss {
  double c2 = std::numeric_limits<double>::infinity();  // infinite: plain squares, never graduated

  // The last stage keeps a soft edge, so that the answer does not jump when one more submap moves a
  // residual across the threshold.
  static constexpr double kFinalMu = 2.0;

  // Up to here, and from here on, the weight is 1 and 0.
  double FullUpTo(double mu) const { return mu / (mu + 1.0) * c2; }
  double NothingFrom(double mu) const { return (mu + 1.0) / mu * c2; }

  double Value(double s, double mu) const {
    if (s <= FullUpTo(mu)) return s;
    if (s >= NothingFrom(mu)) return c2;
    return 2.0 * std::sqrt(c2 * s * mu * (mu + 1.0)) - mu * (c2 + s);
  }
  // The first derivative by s: the weight of the edge.
  double Weight(double s, double mu) const {
    if (s <= FullUpTo(mu)) return 1.0;
    if (s >= NothingFrom(mu)) return 0.0;
    return std::sqrt(c2 * mu * (mu + 1.0) / s) - mu;
  }
};

}  // namespace seastitch
