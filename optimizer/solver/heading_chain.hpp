#pragma once

#include <vector>

namespace seastitch {

// Variances of the heading error of dead reckoning [rad^2], for a step between two submaps: at its
// first submap, at its second, and of the difference between them.
struct HeadingStep {
  double P_from;
  double P_to;
  double P_step;
};

// Information of the headings of a chain of submaps with respect to north [1/rad^2].
struct HeadingInformation {
  double each = 0.0;   // of every heading
  double first = 0.0;  // added to that of the first heading
};

// Computes how much information each absolute heading of a chain adds, given that neighbouring
// heading errors are correlated. P_first: variance of the first heading [rad^2].
//
// Model: the heading error is a first-order Gauss-Markov process, e_to = k e_from + n, with white
// noise n. Its likelihood has a factor per step (for k near 1 these are the dead-reckoning edges)
// and a factor per heading, with the information
//   (1 - k)^2 / Var(n)               of a heading between the ends
//   (1 - k) / Var(n)                 of the last heading
//   1 / P_first - k (1 - k) / Var(n) of the first heading
// With a free gyro (k = 1) all information is at the first heading. With a compass it grows with
// the number of headings.
//
// One k and one Var(n) are used for all steps. In a turn a compass's deviation changes, and a k
// of its own would give the few submaps there too much weight. For the same reason the information
// of both ends is shared equally among all headings. That is as good where the model holds, since
// the mean of such a process is nearly its best estimate, and better where it does not.
//
// Limit: an error that is constant over the whole dive is treated as if it decorrelated. The yaw of
// the whole map is then less certain than its covariance states.
HeadingInformation InformationOfHeadings(double P_first, const std::vector<HeadingStep>& steps);

}  // namespace seastitch
