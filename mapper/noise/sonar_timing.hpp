#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/survey_noise.hpp"
#include "common/core/time.hpp"
#include "mapper/geometry/georeference.hpp"

namespace seastitch {

// y = factor x + errors that are alike within a block: least squares with bounded residuals, whose
// variance comes from the scatter of the blocks. In bounded memory. Pure.
class BlockRegression {
 public:
  // Of one block, in order.
  struct Row {
    double x = 0.0;
    double y = 0.0;
  };
  void AddBlock(const std::vector<Row>& rows);

  struct Result {
    double factor = 0.0;
    double sigma = 0.0;
    double before = 0.0;  // RMS of y
    double after = 0.0;   // and of y - factor x
  };
  // Nothing where there are too few blocks, or x does not vary.
  std::optional<Result> Estimate() const;

 private:
  struct Sums {
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    double rows = 0.0;
    void Add(const Sums& other);
  };
  Sums Total() const;
  double Factor() const;
  void JoinNeighbours();

  std::vector<Sums> blocks_;
};

// The time offset of the sonar against the attitude, and the scale of roll, from the seabed itself.
// A late stamp georeferences a ping with the roll of another instant: the slope across the track
// then changes in proportion to the roll rate. With a wrong scale it changes in proportion to the
// roll. Both are uncorrelated in a motion that lasts. Successive pings are compared, so that the
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
    // Known when the next ping comes.
    double roll_rate_radps = 0.0;
    double roll_rad = 0.0;
  };
  struct Head {
    std::optional<Look> last;                // its rates are not known yet
    std::optional<Look> before;              // its rates are
    std::vector<BlockRegression::Row> rate;  // slope by roll rate
    std::vector<BlockRegression::Row> roll;  // slope by roll
  };
  static std::optional<Look> LookAt(const GeoreferencedPing& ping);
  // gap_s: to the next ping, which navigation has reached.
  static bool AddRates(const PoseLookup& T_map_vehicle_at, double gap_s, Look* look);
  void Compare(const Look& from, const Look& to, Head* head);
  void Finish(Head* head);

  std::map<std::uint8_t, Head> heads_;
  BlockRegression by_rate_;
  BlockRegression by_roll_;
  std::int64_t pings_ = 0;  // compared
};

}  // namespace seastitch
