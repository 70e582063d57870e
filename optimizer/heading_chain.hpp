#pragma once

#include <vector>

namespace seastitch {

// What dead reckoning says of its heading error at the two ends of a step, and of the step:
// variances [rad^2].
struct HeadingStep {
  double P_from;
  double P_to;
  double P_step;
};

// What the headings of a chain of submaps say against north, each by itself: information [1/rad^2].
struct HeadingInformation {
  double each = 0.0;   // of every one
  double first = 0.0;  // of the first beyond that
};

// A heading error is taken for a first-order Gauss-Markov process, e_to = k e_from + new, whose
// likelihood is that of its steps (for k near 1 the edges of dead reckoning) and, for each heading
// by itself, of (1 - k)^2 / Var(new) in between, (1 - k) / Var(new) at the last, 1 / P - k (1 - k)
// / Var(new) at the first. A free gyro (k = 1) leaves all to the first; a compass lets many say
// more than one.
//
// k and Var(new) are those of all steps together: in a turn a compass's deviation changes, and with
// a k of their own the few submaps there would speak for all lines. For the like reason what the
// two ends have in common is shared out among all, which is as good where the model holds (the mean
// of such a process is nearly its best estimate) and better where it does not. A part of the error
// that stays for the whole dive is counted as if it renewed itself with the rest: there the map's
// turn is less well known than this says.
HeadingInformation InformationOfHeadings(double P_first, const std::vector<HeadingStep>& steps);

}  // namespace seastitch
