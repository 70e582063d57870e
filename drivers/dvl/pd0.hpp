#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "drivers/device_clock.hpp"

// Bottom track of Teledyne's PD0 ensembles, little-endian: fixed leader, variable leader and
// bottom track are read; unknown blocks are skipped by the offsets in the ensemble.
namespace seastitch {

// An ensemble in SI units, in the axes to which the DVL is set.
struct Pd0Ensemble {
  enum class Axes : std::uint8_t { kBeam, kInstrument, kShip, kEarth };

  std::uint16_t number = 0;
  Time time;  // the DVL's clock, resolution 10 ms
  Axes axes = Axes::kInstrument;
  bool levelled = false;  // the DVL rotated the velocities by its tilts (ship or earth axes)
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  double depth_m = 0.0;  // of the transducer: measured or set, resolution 0.1 m
  // Velocity of the bottom with respect to the DVL [m/s]: starboard (or east), forward (or north),
  // up, error velocity; in beam axes along each beam, positive towards the DVL. Nothing: not
  // detected.
  std::array<std::optional<double>, 4> velocity_mps;
  // Range along the DVL's z axis, not slant range [m]. Nothing: bottom not detected.
  std::array<std::optional<double>, 4> range_m;
  // Correlation of each beam, 0 to 255 (best). Nothing: not in the ensemble.
  std::optional<std::array<std::uint8_t, 4>> correlation;
};

struct Pd0Params {
  double beam_angle_rad = Deg2Rad(30.0);  // of the beams from the z axis
  double sigma_mps = 0.01;                // of each component; PD0 does not state it
  double depth_sigma_m = 0.0;             // 0: the depth is not used
  ClockParams clock;
};

// Decodes the ensemble at the beginning of the bytes; *size is its size. Nothing if checksum, sizes
// or time are invalid, or a leader or the bottom track is missing.
std::optional<Pd0Ensemble> DecodePd0(Bytes bytes, std::size_t* size);
std::vector<std::uint8_t> EncodePd0(const Pd0Ensemble& ensemble);

// Converts an ensemble to instrument axes: velocity of the DVL over ground, forward, starboard,
// down. The caller sets the time.
DvlSample ToDvlSample(const Pd0Ensemble& ensemble, const Pd0Params& params);
// The ensemble that a DVL set to instrument axes would send.
Pd0Ensemble ToPd0Ensemble(const DvlSample& sample, const Pd0Params& params);

struct Pd0Output {
  DvlSample dvl;
  std::optional<DepthSample> depth;
};

// Decodes datagrams with one or more ensembles each.
class Pd0Decoder {
 public:
  explicit Pd0Decoder(const Pd0Params& params) : params_(params), stamper_(params.clock) {}

  std::vector<Pd0Output> Add(Bytes datagram, Time recv);

  // pd0_malformed, pd0_repeated, pd0_gaps (ensembles that never came), pd0_unstamped.
  const Counters& counters() const { return counters_; }
  Counters clock_figures() const { return stamper_.Figures("dvl"); }

 private:
  bool IsRepeat(const Pd0Ensemble& ensemble);

  Pd0Params params_;
  Stamper stamper_;
  std::optional<Pd0Ensemble> last_;
  Counters counters_;
};

}  // namespace seastitch
