#pragma once

#include <filesystem>

namespace seastitch {

struct DemoOptions {
  std::filesystem::path survey;   // bench survey YAML
  std::filesystem::path terrain;  // GDAL raster; empty: the survey's own seabed
  double speed = 15.0;            // simulated seconds a second
  std::filesystem::path out;
};

// `seastitch demo`: a simulated survey through the real processes on a private LCM URL, then the
// recorded log through `replay`; prints a table of both beside the truth. Throws
// std::runtime_error where a process does not do its part.
int RunDemo(const DemoOptions& options);

}  // namespace seastitch
