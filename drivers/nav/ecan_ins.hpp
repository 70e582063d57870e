#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/dbc.hpp"
#include "drivers/can/unit_clock.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

// The signals of SBG Systems' ECAN that EcanIns reads, found by their names in the DBC file,
// because a unit's ids can be changed. Throws std::runtime_error if the file lacks one.
SignalMap EcanSignals(const Dbc& dbc);

struct EcanInsParams {
  SignalMap signals;  // EcanSignals()
  ClockParams clock;
  bool altitude_is_depth = false;  // depth is minus the altitude: for an INS under water
};

// An INS of SBG Systems on CAN. Its navigation at one instant (an epoch) is sent in several frames
// after EKF_INFO; which ones is set in the INS. Without EKF_INFO an epoch is lost; without another
// frame, only that frame's values. Values of two epochs are never joined.
class EcanIns : public NavCodec {
 public:
  explicit EcanIns(const EcanInsParams& params);

  std::string unused_messages() const override;
  std::vector<CanFilter> can_filters() const override { return params_.signals.Filters(); }

  // cannelloni_malformed, frame_malformed (too short, or an impossible position),
  // frame_outside_epoch (its EKF_INFO was lost), epoch_empty (EKF_INFO alone), not_computed
  // (positions and velocities of a mode in which the INS lets them drift), unstamped, and those of
  // UnitClock.
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
  // Fields seen in any epoch so far. An epoch that has all of them is published at once.
  Fields seen_;
  std::optional<Solution> solution_;
  bool hears_others_ = false;
};

}  // namespace seastitch
