#pragma once

#include <vector>

namespace seastitch {

struct Rgb {
  double r = 0.0, g = 0.0, b = 0.0;  // 0 to 1
};

// Colours at equal steps from the lowest value to the highest.
using ColourScale = std::vector<Rgb>;
const ColourScale& DepthColours();        // pale sand (shallow) to deep blue
const ColourScale& ConsistencyColours();  // pale yellow (agrees) to dark purple (does not)

}  // namespace seastitch
