#include <algorithm>
#include <cstdlib>

#include "drivers/dvl/dvl_nmea2000.hpp"
#include "drivers/imu/imu_nmea2000.hpp"

// A run of frames through both decoders: a byte each of group, source and length, then the data.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  constexpr std::uint32_t kGroups[] = {
      kPgnVesselSpeed, kPgnWaterDepth, kPgnRateOfTurn, kPgnAttitude};
  DvlN2kDecoder dvl({});
  ImuN2kDecoder imu({});
  ByteReader in(Bytes(data, size));
  for (int i = 0; i < 256 && in.left() >= 3; ++i) {
    CanFrame frame;
    frame.extended = true;
    frame.id = 2U << 26 | kGroups[in.Le<std::uint8_t>() % 4] << 8;
    frame.id |= in.Le<std::uint8_t>();
    frame.SetData(in.Take(std::min<std::size_t>(in.Le<std::uint8_t>() % 9, in.left())));
    const Time recv = FromUtime(1'700'000'000'000'000 + 1000 * std::int64_t{i});
    const auto velocity = dvl.Add(frame, recv).dvl;
    if (velocity && !velocity->v_dvl_mps.allFinite()) std::abort();
    const auto sample = imu.Add(frame, recv);
    if (sample && !sample->angular_rate_radps.allFinite()) std::abort();
  }
  return 0;
}
