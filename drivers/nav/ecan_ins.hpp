#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/dbc.hpp"
#include "drivers/can/unit_clock.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

// The messages of SBG Systems' ECAN that EcanIns reads, by their names in the DBC file: a unit's
// ids can be changed. Throws std::runtime_error for one that the file has not.
SignalMap EcanSignals(const Dbc& dbc);

struct EcanInsParams {
  SignalMap signals;  // EcanSignals()
  ClockParams clock;
  bool altitude_is_depth = false;  // with its sign turned: of an INS under water
};

// An INS of SBG Systems on CAN. Its navigation at one instant (an epoch) comes in several frames
// behind EKF_INFO, those that are switched on. A frame that was lost costs its own values, EKF_INFO
// the epoch; values of two epochs are never joined.
class EcanIns : public NavCodec {
 public:
  explicit EcanIns(const EcanInsParams& params);

  std::string hears_instead() const override;
  std::vector<CanFilter> can_filters() const override { return params_.signals.Filters(); }

  // cannelloni_malformed, frame_malformed (too short, or no place on Earth), frame_outside_epoch
  // (EKF_INFO was lost), epoch_empty (EKF_INFO alone), not_computed (positions and velocities that
  // the INS lets drift), unstamped, and those of UnitClock.
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 private:
  using Fields = std::bitset<kMaxFields>;
  struct Epoch {
    UnitClock::Reading info;
    FieldValues values;
    bool given = false;
  };
  struct Solution {
    std::uint32_t word;
    Time recv;
  };

  // bytes: a cannelloni packet.
  void Read(Bytes bytes, Time recv) override;
  void Take(const CanFrame& frame, Time recv);
  void Open(const UnitClock::Reading& info);
  void Collect(const FieldValues& values, Time recv);
  void Close();
  void Finish();
  NavigationSample SampleOf(const FieldValues& values) const;
  double Sigma(const FieldValues& values, std::size_t field) const;

  EcanInsParams params_;
  UnitClock clock_;
  double max_epoch_s_;
  std::optional<Epoch> epoch_;
  Fields seen_;  // what epochs have had so far: one that has it all is given at once
  std::optional<Solution> solution_;
  bool hears_others_ = false;
};

}  // namespace seastitch
