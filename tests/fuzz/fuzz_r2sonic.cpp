#include "tests/fuzz/mbes_stream.hpp"

namespace {

// The packet's size.
void Seal(std::vector<std::uint8_t>* d) {
  if (d->size() < 12) return;
  for (std::size_t i = 0; i < 4; ++i)
    (*d)[4 + i] = static_cast<std::uint8_t>(d->size() >> (24 - 8 * i));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  seastitch::DecodeRun("r2sonic", seastitch::Bytes(data, size), Seal);
  return 0;
}
