#pragma once

#include <vector>

namespace seastitch {

// Variances of the heading error by dead reckoning [rad^2]: at both ends of a step between two
// submaps, and of the step itself.
struct HeadingStep {
  double P_from;
  double P_to;
  double P_step;
};

// Information of the headings of a chain of submaps about north [1/rad^2].
struct HeadingInformation {
  double each = 0.0;   // of every heading
  double first = 0.0;  // of the first heading, in addition
};

// Model: the heading error is a first-order Gauss-Markov process, e_to = k e_from + new. Its
// likelihood has factors for the steps (for k near 1 these are the dead-reckoning edges) and one
// for each heading, with the information
//   (1 - k)^2 / Var(new)               between the ends
//   (1 - k) / Var(new)                 at the last
//   1 / P - k (1 - k) / Var(new)       at the first
// With a free gyro (k = 1) all information is at the first heading. With a compass it grows with
// the number of headings.
//
// One k and one Var(new) are used for all steps. In a turn a compass's deviation changes, and a k
// of its own would give the few submaps there too much weight. For the same reason the information
// of both ends is shared equally among all headings. That is as good where the model holds, since
// the mean of such a process is nearly its best estimate, and better where it does not.
//
// Limit: a part of the error that is constant over the whole dive is treated as if it renewed
// itself. The turn of the map is then less certain than its covariance states.
HeadingInformation InformationOfHeadings(double P_first, const std::vector<HeadingStep>& steps);

}  // namespace seastitch
