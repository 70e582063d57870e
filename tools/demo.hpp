#pragma once

#include <filesystem>

namespace seastitch {

struct DemoOptions {
  std::filesystem::path survey;   // bench survey YAML
  std::filesystem::path terrain;  // GDAL raster; empty: the survey's own seabed
  double speed = 15.0;            // simulated seconds a second
  std::filesystem::path out;
};

// `seastitch demo`: simulates a survey with the real processes on a private LCM URL, then replays
// the recorded log; prints the errors of both maps against the truth. Throws std::runtime_error if
// a process fails.
int RunDemo(const DemoOptions& options);

}  // namespace seastitch
