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
  // Roll about the time of one ping.
  struct Roll {
    Time time;
    double rate_radps = 0.0;
    double angle_rad = 0.0;
  };
  // Roll at the ping before of the same head and another time; nothing where it is not known. Call
  // it for each ping in turn. It uses no soundings, and may run beside Add() of earlier pings.
  // T_map_vehicle_at: about the time of the ping before, up to that of this one.
  std::optional<Roll> RollBefore(const GeoreferencedPing& ping, const PoseLookup& T_map_vehicle_at);
  // before: of RollBefore().
  void Add(const GeoreferencedPing& ping, const std::optional<Roll>& before);

  SonarTimingEstimate estimate() const;

 private:
  // Seabed below the vehicle as one ping measures it.
  struct Look {
    Time time;
    double slope_rad = 0.0;  // across, positive where it is deeper to starboard
    Roll roll;               // known when the next ping comes
  };
  struct Head {
    std::optional<Look> last;                // its roll is not known yet
    std::optional<Look> before;              // its roll is
    std::vector<BlockRegression::Row> rate;  // slope by roll rate
    std::vector<BlockRegression::Row> roll;  // slope by roll
  };
  static std::optional<Look> LookAt(const GeoreferencedPing& ping);
  void Compare(const Look& from, const Look& to, Head* head);
  void Finish(Head* head);

  std::map<std::uint8_t, Time> times_;  // of each head's last ping, for RollBefore()
  std::map<std::uint8_t, Head> heads_;
  BlockRegression by_rate_;
  BlockRegression by_roll_;
  std::int64_t pings_ = 0;  // compared
};

}  // namespace seastitch
