#pragma once

#include <vector>

#include "codecs/lines/line_points.hpp"

namespace seastitch {

// Every point as a ping without soundings: its coordinates are the ping's origin, its line the
// ping's number.
class OneEach : public LinePoints {
 public:
  void Add(const LinePoint& point, std::vector<SurveyRecord>* out) override {
    PlacedPing ping;
    ping.time = Time(FromSeconds(point.time_s.value_or(-1.0)));
    ping.ping_number = point.line;
    ping.p_vehicle_origin_m = point.p;
    out->emplace_back(ping);
  }
  void Finish(std::vector<SurveyRecord>*) override {}
};

}  // namespace seastitch
