#include "optimizer/solver/heading_chain.hpp"

#include <algorithm>

namespace seastitch {
namespace {

// Smaller differences are rounding.
constexpr double kRounding = 1e-9;

}  // namespace

HeadingInformation InformationOfHeadings(double P_first, const std::vector<HeadingStep>& steps) {
  HeadingInformation headings{0.0, 1.0 / P_first};
  if (steps.empty()) return headings;
  HeadingStep mean{0.0, 0.0, 0.0};
  double P_least = P_first;
  const auto n = static_cast<double>(steps.size());
  for (const HeadingStep& step : steps) {
    mean.P_from += step.P_from / n;
    mean.P_to += step.P_to / n;
    mean.P_step += step.P_step / n;
    P_least = std::min({P_least, step.P_from, step.P_to});
  }
  // P_step = P_from + P_to - 2 k P_from.
  const double k =
      1.0 - std::clamp((mean.P_from - mean.P_to + mean.P_step) / (2.0 * mean.P_from), 0.0, 1.0);
  if (1.0 - k < kRounding) return headings;
  // Where the variances fall, as after the start, the difference would be negative.
  const double P_new = std::max(mean.P_to - k * k * mean.P_from, (1.0 - k * k) * P_least);
  const double between = (1.0 - k) * (1.0 - k) / P_new;
  const double last = (1.0 - k) / P_new;
  headings.each = ((n - 1.0) * between + 2.0 * last) / (n + 1.0);
  headings.first = std::max(0.0, headings.first - k * last - last);
  return headings;
}

}  // namespace seastitch
