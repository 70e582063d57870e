#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/survey_noise.hpp"
#include "common/core/time.hpp"
#include "mapper/geometry/georeference.hpp"

namespace seastitch {

// y = factors . x + errors that are alike within a block: least squares with bounded residuals,
// whose covariance comes from the scatter of the blocks. In bounded memory. Pure.
class BlockRegression {
 public:
  using Vector = Eigen::Vector2d;  // a regressor that is not there is zero

  // Of one block, in order.
  struct Row {
    Vector x = Vector::Zero();
    double y = 0.0;
  };
  void AddBlock(const std::vector<Row>& rows);

  struct Result {
    double factor = 0.0;  // of the first regressor
    double sigma = 0.0;
    double before = 0.0;  // RMS of y
    double after = 0.0;   // and of y - factors . x
  };
  // Nothing where there are too few blocks, or x does not vary.
  std::optional<Result> Estimate() const;

 private:
  struct Sums {
    Eigen::Matrix2d xx = Eigen::Matrix2d::Zero();
    Vector xy = Vector::Zero();
    double yy = 0.0;
    double rows = 0.0;
    void Add(const Sums& other);
  };
  Sums Total() const;
  static Eigen::Matrix2d Inverse(const Eigen::Matrix2d& xx);
  Vector Factors() const;
  void JoinNeighbours();

  std::vector<Sums> blocks_;
};

// The time offset of the sonar against the attitude, from the seabed itself. A late stamp
// georeferences a ping with the roll of another instant: the slope across the track then changes in
// proportion to the roll rate. Where the seabed slopes along, a pitch that it did not have moves
// soundings along the slope, and the depth changes. Successive pings are compared, so that the
// seabed's own slope cancels. Pure.
class SonarTiming {
 public:
  // T_map_vehicle_at: about the time of the ping before, up to that of this one.
  void Add(const GeoreferencedPing& ping, const PoseLookup& T_map_vehicle_at);

  SonarTimingEstimate estimate() const;

 private:
  // Seabed below the vehicle as one ping measures it.
  struct Look {
    Time time;
    double slope_rad = 0.0;  // across, positive where it is deeper to starboard
    double depth_m = 0.0;    // in the map, under the vehicle
    double altitude_m = 0.0;
    Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();  // in the map
    Eigen::Vector2d p_map = Eigen::Vector2d::Zero();   // under the vehicle
    // Known when the next ping comes.
    double roll_rate_radps = 0.0;
    double pitch_rate_radps = 0.0;
    double sink_rate_mps = 0.0;
  };
  struct Head {
    std::optional<Look> last;    // its rates are not known yet
    std::optional<Look> before;  // its rates are
    std::vector<BlockRegression::Row> roll;
    struct Along {
      double depth_m, way_m, altitude_m, pitch_rate_radps, sink_rate_mps;  // changes but altitude
    };
    std::vector<Along> along;
  };
  static std::optional<Look> LookAt(const GeoreferencedPing& ping);
  // gap_s: to the next ping, which navigation has reached.
  static bool AddRates(const PoseLookup& T_map_vehicle_at, double gap_s, Look* look);
  void Compare(const Look& from, const Look& to, Head* head);
  void Finish(Head* head);

  std::map<std::uint8_t, Head> heads_;
  BlockRegression roll_;
  BlockRegression pitch_;
  std::int64_t pings_ = 0;  // compared
};

}  // namespace seastitch
