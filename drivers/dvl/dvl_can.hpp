#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/sensors.hpp"
#include "drivers/can/signal_map.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/dvl/dvl_codec.hpp"

// A Doppler log behind a CAN gateway: docs/dvl_can.md, or anything like it.
namespace seastitch {

enum DvlField : std::size_t {
  kDvlTimeS,  // UTC; its frame opens an ensemble
  kDvlTimeUs,
  kDvlVelocityX,
  kDvlVelocityY,
  kDvlVelocityZ,
  kDvlBottomLock,
  kDvlSigmaX,
  kDvlSigmaY,
  kDvlSigmaZ,
  kDvlBeamRange1,
  kDvlBeamRange2,
  kDvlBeamRange3,
  kDvlBeamRange4,
  kDvlBeamValid1,
  kDvlBeamValid2,
  kDvlBeamValid3,
  kDvlBeamValid4,
  kDvlBeamVelocity1,
  kDvlBeamVelocity2,
  kDvlBeamVelocity3,
  kDvlBeamVelocity4,
  kDvlBeamQuality1,  // 0 to 1
  kDvlBeamQuality2,
  kDvlBeamQuality3,
  kDvlBeamQuality4,
  kDvlErrorVelocity,
  kDvlAltitude,
  kDvlAltitudeValid,
  kDepthPressure,
  kDepthDepth,
  kDepthSigma,
  kNumDvlFields,
};

// The key of each field in the YAML file, in the order of DvlField.
extern const std::vector<std::string> kDvlFieldKeys;

struct DvlCanParams {
  SignalMap signals;
  ClockParams clock;
  // Frames this long after the first of their ensemble belong to another one. Above the time of a
  // burst on the wire, not above half the ping period.
  double max_ensemble_s = 0.030;

  // Of the signals: what is missing; empty if usable.
  std::string Validate() const;
};

// Puts ensembles together. An ensemble has a velocity part, a depth part, or both; each part is
// given by the frame that completes it, with the time of the ensemble.
class DvlCanDecoder : public DvlCodec {
 public:
  explicit DvlCanDecoder(const DvlCanParams& params);

  DvlOutput Add(const CanFrame& frame, Time recv) override;
  void Finish() override;

  // dvl_frame_malformed, dvl_frame_outside_ensemble, dvl_ensemble_incomplete,
  // depth_ensemble_incomplete, dvl_time_malformed, dvl_ensemble_unstamped.
  Counters counters() const override { return counters_; }
  Counters clock_figures() const override { return stamper_.Figures("dvl"); }
  std::vector<CanFilter> filters() const override { return params_.signals.Filters(); }

 private:
  struct Ensemble {
    Time time;
    Time first_recv;
    FieldValues values;
    bool dvl_given = false;
    bool depth_given = false;
  };
  void Open(const FieldValues& values, Time recv);

  DvlCanParams params_;
  std::bitset<kMaxFields> dvl_fields_;
  std::bitset<kMaxFields> depth_fields_;
  std::optional<Ensemble> ensemble_;
  Stamper stamper_;
  Counters counters_;
};

// Samples to the frames of one ensemble, the time frame first. Where both are given the DVL's time
// counts. Empty where neither is given.
class DvlCanEncoder {
 public:
  explicit DvlCanEncoder(const SignalMap& signals) : signals_(signals) {}
  std::vector<CanFrame> Encode(const std::optional<DvlSample>& dvl,
                               const std::optional<DepthSample>& depth) const;

 private:
  SignalMap signals_;
};

}  // namespace seastitch
