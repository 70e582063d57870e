#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/nmea2000.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/dvl/dvl_codec.hpp"

// A DVL on NMEA 2000: speed over ground (PGN 130578) and depth below the transducer
// (128267). The groups have no time, no vertical speed, no beams and no sigmas.
namespace seastitch {

inline constexpr std::uint32_t kPgnVesselSpeed = 130578;
inline constexpr std::uint32_t kPgnWaterDepth = 128267;

struct DvlN2kParams {
  int source = -1;               // address of the DVL; -1: any
  double sigma_mps = 0.05;       // of the horizontal components
  double sigma_z_mps = 1.0;      // of the vertical one, which is published as 0
  double max_depth_age_s = 0.5;  // an older depth is not published as altitude
  ClockParams clock{DeviceClock::kReceive, 0.0};
};

class DvlN2kDecoder : public DvlCodec {
 public:
  explicit DvlN2kDecoder(const DvlN2kParams& params) : params_(params), stamper_(params.clock) {}

  DvlOutput Add(const CanFrame& frame, Time recv) override;
  // dvl_frame_malformed, and those of the fast packets.
  Counters counters() const override;
  Counters clock_figures() const override { return stamper_.Figures("dvl"); }
  std::vector<CanFilter> filters() const override {
    return {N2kFilter(kPgnVesselSpeed), N2kFilter(kPgnWaterDepth)};
  }

 private:
  void ReadDepth(Bytes data, Time recv);
  std::optional<DvlSample> ReadSpeed(Bytes data, Time recv);

  DvlN2kParams params_;
  N2kFastPackets packets_;
  Stamper stamper_;
  std::optional<double> depth_m_;  // below the transducer; nothing: no bottom
  Time depth_recv_;
  Counters counters_;
};

// The frames of one ping: speed, and depth below the transducer where the sample has an altitude.
std::vector<CanFrame> EncodeDvlN2k(const DvlSample& sample, std::uint8_t source, int sequence);

}  // namespace seastitch
