#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "codecs/lines/line_stream.hpp"
#include "codecs/navigation/nmea0183.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

// Base of instruments that send lines of NMEA 0183: splits bytes into sentences, counts them, and
// converts their times with the device's clock.
class NmeaCodec : public NavCodec {
 public:
  std::string unused_messages() const override;
  // nmea_malformed, nmea_checksum_wrong, nmea_checksum_missing, nmea_other (sentences of types that
  // are not used), nmea_too_long (bytes), unstamped, and those of the instrument.
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 protected:
  NmeaCodec(bool needs_checksum, const ClockParams& clock)
      : needs_checksum_(needs_checksum), clock_(clock) {}

  // Reads a sentence. recv: receive stamp of the piece in which it began. False if its type is not
  // used.
  virtual bool Take(const NmeaSentence& sentence, Time recv) = 0;
  // Reads a line that is not an NMEA sentence. True if it was used.
  virtual bool TakeLine(const std::string& /*line*/, Time /*recv*/) { return false; }

  void SetDate(Time device, Time recv) { clock_.SetDate(device, recv); }
  // UTC of a time of day; counts sentences without a usable time as unstamped.
  std::optional<Time> Stamp(std::optional<Duration> time_of_day, Time recv);

 private:
  void Read(Bytes bytes, Time recv) final;
  Counters of_lines() const;

  bool needs_checksum_;
  DayClock clock_;
  LineStream lines_;
  std::int64_t others_ = 0;  // sentences of types that are not used
  std::set<std::string, std::less<>> other_types_;
  Counters line_counters_;
};

}  // namespace seastitch
