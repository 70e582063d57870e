#pragma once

#include <optional>

#include "drivers/nav/nmea_stream.hpp"

namespace seastitch {

struct NmeaInsParams {
  ClockParams clock;
  bool needs_checksum = true;
  bool invert_roll = false;   // the instrument's roll is positive with the port side down
  bool invert_pitch = false;  // its pitch is positive with the bow down
};

// An INS that speaks NMEA 0183, to navigation: position and height (GGA, else RMC), velocity over
// ground (RMC, VTG), attitude (PASHR, PSXN, PRDID; of several the first that was heard, until it
// is silent for 2 s; heading of HDT or THS where they give none), status (GGA, PSXN). Each sentence
// is a sample of its own, as it comes.
class NmeaIns : public NavCodec {
 public:
  explicit NmeaIns(const NmeaInsParams& params);

  std::vector<NavOutput> Add(Bytes bytes, Time recv) override;
  std::int64_t heard() const override { return stream_.heard(); }
  std::string hears_instead() const override { return stream_.hears_instead(); }

  // Those of NmeaStream; sentence_incomplete (without what it is for), attitude_not_used (of
  // another type than that in use), attitude_without_heading, heading_without_tilt (nothing else
  // gives roll and pitch), no_position (called void), unstamped.
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 private:
  using Attitude183 = std::optional<NmeaAttitude> (*)(const NmeaSentence& sentence);

  // False: of a type that is not read.
  bool Take(const NmeaSentence& sentence, Time recv);
  void TakeGga(const NmeaSentence& sentence, Time recv);
  void TakeRmc(const NmeaSentence& sentence, Time recv);
  void TakeVtg(const NmeaSentence& sentence, Time recv);
  void TakeHeading(const NmeaSentence& sentence, Time recv);
  void TakeQuality(const NmeaSentence& sentence);
  void TakeAttitude(const NmeaSentence& sentence, Attitude183 decode, Time recv);
  void Give(NavigationSample sample, std::optional<Duration> time_of_day, Time recv);
  void SetVelocity(const NmeaCourse& course, Time recv);
  std::optional<InsVelocity> VelocityAt(Time recv) const;
  void Count(const char* what) { ++counters_[what]; }

  template <class T>
  struct At {
    T value;
    Time recv;
  };

  NmeaInsParams params_;
  NmeaStream stream_;
  DayClock clock_;
  Counters counters_;
  std::vector<NavOutput> out_;
  std::optional<Time> last_gga_;
  std::optional<At<InsVelocity>> velocity_;
  std::optional<At<double>> heading_rad_;
  std::optional<At<std::string>> attitude_type_;
  bool called_invalid_ = false;  // by PSXN,20
};

}  // namespace seastitch
