#include <cmath>
#include <cstdlib>

#include "drivers/dvl/dvl_can.hpp"
#include "tests/fuzz/can_input.hpp"

namespace {

using namespace seastitch;

// In the order of DvlField.
const std::vector<std::string> kSignals = {"DVL_TIME.SECONDS",
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

void Check(const DvlOutput& out) {
  if (out.dvl && !(out.dvl->v_dvl_mps.allFinite() && out.dvl->sigma_v_mps.allFinite()))
    std::abort();
  if (out.depth && !(std::isfinite(out.depth->depth_m) && std::isfinite(out.depth->sigma_m)))
    std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto device =
      ShippedParams<DvlCanParams>("seastitch_dvl.dbc", kSignals, DeviceClock::kDevice);
  static const auto model =
      ShippedParams<DvlCanParams>("seastitch_dvl.dbc", kSignals, DeviceClock::kModel);
  DecodeFrames<DvlCanDecoder>(Bytes(data, size), device, model, Check);
  return 0;
}
