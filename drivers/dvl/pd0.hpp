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
// bottom track are read, blocks that are not known stepped over by the ensemble's own offsets.
namespace seastitch {

// An ensemble in SI, as the log gave it.
struct Pd0Ensemble {
  enum class Axes : std::uint8_t { kBeam, kInstrument, kShip, kEarth };

  std::uint16_t number = 0;
  Time time;  // the log's own clock, steps of 10 ms
  Axes axes = Axes::kInstrument;
  bool levelled = false;  // the log turned the velocities by its tilts
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  // Of the bottom past the log: starboard (or east), forward (or north), up, error; or towards the
  // log along each beam. Nothing: no bottom.
  std::array<std::optional<double>, 4> velocity_mps;
  // Along the log's z axis, not along the beams. Nothing: no bottom.
  std::array<std::optional<double>, 4> range_m;
  // How like each other the two pulses of a beam came back: 0 to 255. Nothing: none was stated.
  std::optional<std::array<std::uint8_t, 4>> correlation;
};

struct Pd0Params {
  double beam_angle_rad = Deg2Rad(30.0);  // of the beams from the log's axis
  double sigma_mps = 0.01;                // of each component; PD0 does not give it
  ClockParams clock;
};

// The ensemble that the bytes begin with, and its size in *size. Nothing where checksum, sizes or
// time make no sense, or a leader or the bottom track is missing.
std::optional<Pd0Ensemble> DecodePd0(Bytes bytes, std::size_t* size);
std::vector<std::uint8_t> EncodePd0(const Pd0Ensemble& ensemble);

// Velocities in the log's own axes (forward, starboard, down, of the log over ground), whatever
// axes it gave them in. time is left to the caller.
DvlSample ToDvlSample(const Pd0Ensemble& ensemble, const Pd0Params& params);
// The ensemble of a log set to instrument axes.
Pd0Ensemble ToPd0Ensemble(const DvlSample& sample, const Pd0Params& params);

// Ensembles as they come in datagrams, one or more in each.
class Pd0Decoder {
 public:
  explicit Pd0Decoder(const Pd0Params& params) : params_(params), stamper_(params.clock) {}

  std::vector<DvlSample> Add(Bytes datagram, Time recv);

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
