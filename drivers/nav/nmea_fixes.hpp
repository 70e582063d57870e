#pragma once

#include <optional>
#include <string>

#include "drivers/nav/nmea_codec.hpp"

namespace seastitch {

struct NmeaFixParams {
  std::string source{};  // of the fixes: "gps" or "usbl"
  ClockParams clock;
  bool needs_checksum = true;
  double sigma_m = kGpsSigmaAtHdop1M;  // north and east each, 1 sigma; for GPS at an HDOP of 1
  double interval_s = 1.0;             // minimum between two fixes, whose errors are correlated
  // USBL: the transponder of this vehicle; empty: the first that is received.
  std::string transponder{};
};

// Position fixes: GGA of a GPS receiver at the surface; PSIMSSB or GGA of an acoustic system.
// Positions that a receiver extrapolates, simulates, or takes from manual input are not used.
class NmeaFixes : public NmeaCodec {
 public:
  explicit NmeaFixes(const NmeaFixParams& params);

  // Counters: those of NmeaCodec; no_position (marked invalid), not_measured (extrapolated,
  // simulated or manual), not_absolute (relative to the ship), other_transponder, too_soon
  // (repeated, or within interval_s), sentence_incomplete, unstamped.

 private:
  bool Take(const NmeaSentence& sentence, Time recv) override;
  void TakeGga(const NmeaSentence& sentence, Time recv);
  void TakePsimssb(const NmeaSentence& sentence, Time recv);
  void Fix(const GeoPoint& point, double sigma_m, std::optional<Duration> time_of_day, Time recv);

  NmeaFixParams params_;
  std::optional<Time> last_;
};

}  // namespace seastitch
