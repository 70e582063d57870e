#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "drivers/dvl/pd0.hpp"

namespace {

using namespace seastitch;

// Length and checksum made right, so that the fuzzer gets past them.
std::vector<std::uint8_t> Sealed(Bytes bytes) {
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  if (sealed.size() < 8) return sealed;
  const std::size_t end = sealed.size() - 2;
  sealed[2] = static_cast<std::uint8_t>(end);
  sealed[3] = static_cast<std::uint8_t>(end >> 8);
  unsigned sum = 0;
  for (std::size_t i = 0; i < end; ++i) sum += sealed[i];
  sealed[end] = static_cast<std::uint8_t>(sum);
  sealed[end + 1] = static_cast<std::uint8_t>(sum >> 8);
  return sealed;
}

}  // namespace

// A run of ensembles, each behind a length of two bytes, through one decoder.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Pd0Params params;
  params.depth_sigma_m = 0.1;
  Pd0Decoder decoder(params);
  ByteReader in(Bytes(data, size));
  for (int i = 0; i < 64 && in.left() >= 2; ++i) {
    const std::size_t length = std::min<std::size_t>(in.Le<std::uint16_t>(), in.left());
    const auto outputs = decoder.Add(Sealed(in.Take(length)), FromUtime(1'700'000'000'000'000 + i));
    for (const Pd0Output& output : outputs)
      if (!output.dvl.v_dvl_mps.allFinite() ||
          !std::isfinite(output.dvl.altitude_m.value_or(0.0)) ||
          !std::isfinite(output.depth->depth_m))
        std::abort();
  }
  return 0;
}
