#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/health/counters.hpp"

namespace seastitch {

// A sounding of a processed line, in the coordinates of its file.
struct LinePoint {
  // East or longitude, north or latitude, height or depth: axes, units and signs of the file.
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  std::optional<double> time_s;  // from an instant that the file does not state
  std::uint16_t line = 0;        // number of the line, where one file holds several
};

// Takes the points of a file in its order and makes records of them, which need more than the file
// has: the track of the vehicle.
class LinePoints {
 public:
  virtual ~LinePoints() = default;
  virtual void Add(const LinePoint& point, std::vector<SurveyRecord>* out) = 0;
  // After the last point.
  virtual void Finish(std::vector<SurveyRecord>* out) = 0;
  virtual Counters counters() const { return {}; }
};

}  // namespace seastitch
