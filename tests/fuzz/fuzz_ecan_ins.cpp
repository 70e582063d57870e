#include <cstdlib>

#include "drivers/nav/ecan_ins.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "tests/fuzz/can_input.hpp"

namespace {

using namespace seastitch;

EcanInsParams Shipped(DeviceClock clock) {
  EcanInsParams params;
  params.signals = EcanSignals(Dbc::Load(ConfigFile("sbg_ecan.dbc")));
  params.clock.clock = clock;
  return params;
}

void Check(const std::vector<NavOutput>& outputs) {
  for (const NavOutput& output : outputs) {
    const auto& s = std::get<NavigationSample>(output);
    if (s.position && !(std::abs(s.position->latitude_rad) <= 1.5707963267949)) std::abort();
    if (s.attitude && !(s.attitude->q_ned_imu.coeffs().allFinite() &&
                        s.attitude->sigma_rpy_rad.minCoeff() >= 0.0))
      std::abort();
    if (s.velocity && !s.velocity->v_ned_mps.allFinite()) std::abort();
  }
}

}  // namespace

// Frames that it wants, by the clock that the first byte chooses; and the bytes as a packet.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const EcanInsParams device = Shipped(DeviceClock::kDevice);
  static const EcanInsParams model = Shipped(DeviceClock::kModel);
  if (size == 0) return 0;
  EcanIns ins(data[0] % 2 == 0 ? device : model);
  for (const ReceivedFrame& received : FramesOf(Bytes(data, size).subspan(1), ins.can_filters()))
    Check(ins.Add(EncodeCannelloni({&received.frame, 1}, 0), received.recv));
  Check(ins.Add(Bytes(data, size), FromUtime(1'700'000'000'000'000)));
  return 0;
}
