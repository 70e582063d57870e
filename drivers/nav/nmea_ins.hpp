#pragma once

#include <optional>

#include "drivers/nav/nmea_codec.hpp"

namespace seastitch {

struct NmeaInsParams {
  ClockParams clock;
  bool needs_checksum = true;
  bool invert_roll = false;   // the instrument's roll is positive with the port side down
  bool invert_pitch = false;  // its pitch is positive with the bow down
};

// An INS with NMEA 0183: position and height (GGA, else RMC), velocity over ground (RMC, VTG),
// attitude (PASHR, PSXN or PRDID: the type that was received first, until it is silent for 2 s;
// heading of HDT or THS if these give none), status (GGA, PSXN). Each sentence becomes a separate
// sample.
class NmeaIns : public NmeaCodec {
 public:
  explicit NmeaIns(const NmeaInsParams& params);

  // Counters: those of NmeaCodec; sentence_incomplete (main fields missing), attitude_not_used (of
  // another type than the one in use), attitude_without_heading, heading_without_tilt (no other
  // sentence gives roll and pitch), no_position (marked invalid), unstamped.

 private:
  using Attitude183 = std::optional<NmeaAttitude> (*)(const NmeaSentence& sentence);

  // False if the sentence's type is not used.
  bool Take(const NmeaSentence& sentence, Time recv) override;
  void TakeGga(const NmeaSentence& sentence, Time recv);
  void TakeRmc(const NmeaSentence& sentence, Time recv);
  void TakeVtg(const NmeaSentence& sentence, Time recv);
  void TakeHeading(const NmeaSentence& sentence, Time recv);
  void TakeQuality(const NmeaSentence& sentence);
  void TakeAttitude(const NmeaSentence& sentence, Attitude183 decode, Time recv);
  void Finish(NavigationSample sample, std::optional<Duration> time_of_day, Time recv);
  void SetVelocity(const NmeaCourse& course, Time recv);
  std::optional<GeoVelocity> VelocityAt(Time recv) const;

  template <class T>
  struct At {
    T value;
    Time recv;
  };

  NmeaInsParams params_;
  std::optional<Time> last_gga_;
  std::optional<At<GeoVelocity>> velocity_;
  std::optional<At<double>> heading_rad_;
  std::optional<At<std::string>> attitude_type_;
  bool called_invalid_ = false;  // marked invalid by PSXN,20
};

}  // namespace seastitch
