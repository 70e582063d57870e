#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "codecs/navigation/phins.hpp"
#include "drivers/nav/ins_frames.hpp"

namespace {

using namespace seastitch;

// Size and checksum of a frame of version 2 or 3 made right, so that the fuzzer gets past them.
std::vector<std::uint8_t> Sealed(Bytes bytes) {
  std::vector<std::uint8_t> frame(bytes.begin(), bytes.end());
  const std::size_t header = frame.size() > 2 && frame[2] == 2 ? 11 : 15;
  if (frame.size() < header + 14 || frame[0] != 'I') return frame;
  frame[header] = static_cast<std::uint8_t>(frame.size() >> 8);
  frame[header + 1] = static_cast<std::uint8_t>(frame.size());
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i + 4 < frame.size(); ++i) sum += frame[i];
  for (std::size_t i = 0; i < 4; ++i)
    frame[frame.size() - 4 + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
  return frame;
}

void Feed(Bytes bytes, NavCodec* codec) {
  std::int64_t utime = 1'700'000'000'000'000;
  for (std::size_t at = 0; at < bytes.size(); at += 70)
    for (const NavOutput& output :
         codec->Add(bytes.subspan(at, std::min<std::size_t>(70, bytes.size() - at)),
                    FromUtime(utime += 10'000))) {
      const auto* ins = std::get_if<NavigationSample>(&output);
      if (ins == nullptr) continue;
      if (ins->position && !(std::abs(ins->position->latitude_rad) <= 1.5707963267949))
        std::abort();
      if (ins->attitude && !ins->attitude->q_ned_imu.coeffs().allFinite()) std::abort();
    }
}

}  // namespace

// The bytes as they are, and with a frame that is whole, through the binary protocols of INS.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const auto& bytes : {std::vector<std::uint8_t>(data, data + size), Sealed({data, size})}) {
    PhinsIns phins({});
    KmBinaryIns kmb({});
    Feed(bytes, &phins);
    Feed(bytes, &kmb);
  }
  return 0;
}
