#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "codecs/navigation/nmea0183_writer.hpp"
#include "common/core/sensors.hpp"
#include "common/geo/map_frame.hpp"

namespace seastitch {

struct NavSentencesParams {
  std::string talker = "IN";
  // Horizontal 1 sigma (root of the sum of both variances) up to which GGA states the quality of a
  // receiver's fix (1); above it that of an estimate (6).
  double fix_sigma_m = 10.0;
  // Above it the position is not known: quality 0, without a position.
  double position_sigma_max_m = 300.0;
  double gga_hz = 5.0;
  double rmc_hz = 5.0;
  double gst_hz = 1.0;
  double hdt_hz = 10.0;
  double vtg_hz = 5.0;
  double dpt_hz = 1.0;
  double zda_hz = 1.0;
};

// Most bytes a second of these sentences.
double BytesPerSecondOf(const NavSentencesParams& params);

// Navigation as NMEA 0183 sentences, each at its rate. A sentence is made with the first state of
// each period of its rate, by the state's time, periods counted from a whole second; so a clock
// that steps delays nothing.
class NavSentences {
 public:
  NavSentences(const NavSentencesParams& params, const MapFrame& map);

  // The sentences that are due with this state, in the order GGA, RMC, GST, HDT, VTG, DPT, ZDA.
  // altitude: above the bottom.
  std::string Add(const NavState& state, std::optional<double> altitude_m);
  // Whether the last state had a position whose sigma is small enough to be sent.
  bool has_position() const { return has_position_; }

 private:
  NmeaState StateOf(const NavState& state, std::optional<double> altitude_m);

  NavSentencesParams params_;
  MapFrame map_;
  NmeaWriter writer_;
  static constexpr std::size_t kKinds = 7;
  std::array<std::optional<std::int64_t>, kKinds> last_period_;
  bool has_position_ = true;
};

}  // namespace seastitch
