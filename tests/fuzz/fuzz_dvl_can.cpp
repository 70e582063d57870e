#include <cmath>
#include <cstdlib>

#include "drivers/dvl/dvl_can.hpp"
#include "tests/fuzz/can_input.hpp"

namespace {

using namespace seastitch;

DvlCanParams Shipped(DeviceClock clock) {
  const Dbc dbc = Dbc::Load(SEASTITCH_SOURCE_DIR "/config/seastitch_dvl.dbc");
  // In the order of DvlField.
  const std::vector<std::string> signals = {"DVL_TIME.SECONDS",
                                            "DVL_TIME.MICROSECONDS",
                                            "DVL_VELOCITY.VELOCITY_X",
                                            "DVL_VELOCITY.VELOCITY_Y",
                                            "DVL_VELOCITY.VELOCITY_Z",
                                            "DVL_VELOCITY.BOTTOM_LOCK",
                                            "DVL_SIGMA.SIGMA_X",
                                            "DVL_SIGMA.SIGMA_Y",
                                            "DVL_SIGMA.SIGMA_Z",
                                            "DVL_RANGE.RANGE_1",
                                            "DVL_RANGE.RANGE_2",
                                            "DVL_RANGE.RANGE_3",
                                            "DVL_RANGE.RANGE_4",
                                            "DVL_ALTITUDE.VALID_1",
                                            "DVL_ALTITUDE.VALID_2",
                                            "DVL_ALTITUDE.VALID_3",
                                            "DVL_ALTITUDE.VALID_4",
                                            "DVL_BEAM_VELOCITY.BEAM_VELOCITY_1",
                                            "DVL_BEAM_VELOCITY.BEAM_VELOCITY_2",
                                            "DVL_BEAM_VELOCITY.BEAM_VELOCITY_3",
                                            "DVL_BEAM_VELOCITY.BEAM_VELOCITY_4",
                                            "DVL_ALTITUDE.ALTITUDE",
                                            "DVL_ALTITUDE.ALTITUDE_VALID",
                                            "DEPTH_PRESSURE.PRESSURE",
                                            "DEPTH_DEPTH.DEPTH",
                                            "DEPTH_DEPTH.DEPTH_SIGMA"};
  DvlCanParams params;
  for (std::size_t field = 0; field < signals.size(); ++field)
    params.signals.Assign(dbc, field, signals[field]);
  params.clock.clock = clock;
  return params;
}

void Check(const DvlOutput& out) {
  if (out.dvl && !(out.dvl->v_dvl_mps.allFinite() && out.dvl->sigma_v_mps.allFinite()))
    std::abort();
  if (out.depth && !(std::isfinite(out.depth->depth_m) && std::isfinite(out.depth->sigma_m)))
    std::abort();
}

}  // namespace

// The first byte chooses the clock, the others are frames.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const DvlCanParams params[] = {Shipped(DeviceClock::kDevice),
                                        Shipped(DeviceClock::kModel)};
  static const std::vector<CanFilter> ids = params[0].signals.Filters();
  if (size == 0) return 0;
  DvlCanDecoder decoder(params[data[0] % 2]);
  for (const ReceivedFrame& received : FramesOf(Bytes(data + 1, size - 1), ids))
    Check(decoder.Add(received.frame, received.recv));
  decoder.Finish();
  return 0;
}
