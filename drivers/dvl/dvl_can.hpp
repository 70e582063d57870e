#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/sensors.hpp"
#include "drivers/can/signal_map.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/dvl/dvl_codec.hpp"

// A DVL behind a CAN gateway: the frames of docs/dvl_can.md, or any others that a signal map
// describes.
namespace seastitch {

// Fields of an ensemble. Axes of the instrument: x forward, y starboard, z down. Units:
// docs/drivers.md and the keys.
enum DvlField : std::size_t {
  kDvlTimeS,  // centre of the ping, UTC; a frame with this field begins an ensemble
  kDvlTimeUs,
  kDvlVelocityX,  // of the instrument over ground [m/s]
  kDvlVelocityY,
  kDvlVelocityZ,
  kDvlBottomLock,  // not 0: velocity and sigma are valid
  kDvlSigmaX,      // of the velocity, 1 sigma [m/s]
  kDvlSigmaY,
  kDvlSigmaZ,
  kDvlBeamRange1,  // slant range [m]
  kDvlBeamRange2,
  kDvlBeamRange3,
  kDvlBeamRange4,
  kDvlBeamValid1,
  kDvlBeamValid2,
  kDvlBeamValid3,
  kDvlBeamValid4,
  kDvlBeamVelocity1,  // along the beam, positive towards the bottom [m/s]
  kDvlBeamVelocity2,
  kDvlBeamVelocity3,
  kDvlBeamVelocity4,
  kDvlBeamQuality1,  // 0 (worst) to 1 (best)
  kDvlBeamQuality2,
  kDvlBeamQuality3,
  kDvlBeamQuality4,
  kDvlErrorVelocity,  // difference of the two vertical velocities of four beams [m/s]
  kDvlAltitude,       // vertical, above the bottom [m]
  kDvlAltitudeValid,
  kDepthPressure,  // of the gateway's pressure sensor: gauge [Pa]
  kDepthDepth,     // below the water line, positive down [m]
  kDepthSigma,     // of the depth, 1 sigma [m]
  kNumDvlFields,
};

// The key of each field in the YAML file, in the order of DvlField.
extern const std::vector<std::string> kDvlFieldKeys;

struct DvlCanParams {
  SignalMap signals;
  ClockParams clock;
  // Longest time between the first and the last frame of an ensemble; a later frame is not used.
  // More than a burst of frames takes on the wire, at most half the ping period.
  double max_ensemble_s = 0.030;

  // The first required signal that is missing, for people; empty if there is none.
  std::string Validate() const;
};

// Assembles ensembles from frames. An ensemble has a velocity part, a depth part, or both. Add()
// returns a part with the frame that completes it, stamped with the time of the ensemble.
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
    bool dvl_given = false;  // returned by Add() already
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

// Encodes samples as the frames of one ensemble, the time frame first. If both samples are present,
// the time is that of the DVL. Returns no frames if neither is.
class DvlCanEncoder {
 public:
  explicit DvlCanEncoder(const SignalMap& signals) : signals_(signals) {}
  std::vector<CanFrame> Encode(const std::optional<DvlSample>& dvl,
                               const std::optional<DepthSample>& depth) const;

 private:
  SignalMap signals_;
};

}  // namespace seastitch
