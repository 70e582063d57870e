#include "tests/fuzz/mbes_stream.hpp"

namespace {

// The two length words.
void Seal(std::vector<std::uint8_t>* d) {
  if (d->size() < 8) return;
  for (std::size_t i = 0; i < 4; ++i)
    (*d)[i] = (*d)[d->size() - 4 + i] = static_cast<std::uint8_t>(d->size() >> (8 * i));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  seastitch::DecodeRun("kmall", seastitch::Bytes(data, size), Seal);
  return 0;
}
