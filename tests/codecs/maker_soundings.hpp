#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/codecs/survey_files.hpp"

// A file's raw times and angles through our own geometry, against the soundings that its maker
// computed from them.
namespace seastitch {

struct ComparisonOptions {
  std::string motion_source;  // source of the motion to be used begins so: "#SKM", "A"
  // How the maker traced: from the profile alone, or from the sound speed at the transducer on.
  bool profile_only = false;
  // Depths count from the transmitter as it was (.all), or from the vehicle's reference point.
  bool depth_from_transmitter = false;
};

struct Residual {
  double angle_rad;                  // of the sounding from the vertical; negative: to port
  Eigen::Vector3d percent_of_depth;  // ours less theirs
};

struct Comparison {
  int pings = 0;
  std::vector<Residual> residuals;  // valid beams whose sending and receiving the motion covers

  Eigen::Vector3d Rms(double from_deg = -90.0, double to_deg = 90.0) const;
  void PrintByAngle(const std::string& title) const;
};

Comparison CompareWithMaker(const SurveyContents& file, const ComparisonOptions& options);

}  // namespace seastitch
