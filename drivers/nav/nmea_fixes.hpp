#pragma once

#include <optional>
#include <string>

#include "drivers/nav/nmea_stream.hpp"

namespace seastitch {

struct NmeaFixParams {
  std::string source{};  // of the fixes: "gps" or "usbl"
  ClockParams clock;
  bool needs_checksum = true;
  double sigma_m = 3.0;     // north and east each, 1 sigma; for GPS at an HDOP of 1
  double interval_s = 1.0;  // minimum between two fixes, whose errors are correlated
  // USBL: the transponder of this vehicle; empty: the first that is received.
  std::string transponder{};
};

// Decodes position fixes: GGA of a GPS receiver at the surface; PSIMSSB or GGA of a USBL system.
// Only measured positions become fixes (GGA quality 1 to 5), not estimated, entered or simulated
// ones.
class NmeaFixes : public NavCodec {
 public:
  explicit NmeaFixes(const NmeaFixParams& params);

  std::vector<NavOutput> Add(Bytes bytes, Time recv) override;
  std::int64_t heard() const override { return stream_.heard(); }
  std::string hears_instead() const override { return stream_.hears_instead(); }

  // Those of NmeaStream; no_position (called void), not_measured, not_absolute (as seen from the
  // ship), other_transponder, too_soon (repeated, or within interval_s), sentence_incomplete,
  // unstamped.
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 private:
  bool Take(const NmeaSentence& sentence, Time recv);
  void TakeGga(const NmeaSentence& sentence, Time recv);
  void TakePsimssb(const NmeaSentence& sentence, Time recv);
  void Give(const GeoPoint& point, double sigma_m, std::optional<Duration> time_of_day, Time recv);
  void Count(const char* what) { ++counters_[what]; }

  NmeaFixParams params_;
  NmeaStream stream_;
  DayClock clock_;
  Counters counters_;
  std::vector<NavOutput> out_;
  std::optional<Time> last_;
};

}  // namespace seastitch
