#include "tests/fuzz/mbes_stream.hpp"

namespace {

void PutLe(std::vector<std::uint8_t>* d, std::size_t at, std::size_t value) {
  for (std::size_t i = 0; i < 4; ++i) (*d)[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

// The packet's size; where the packet is all of its transmission, that size too, and no checksum.
void Seal(std::vector<std::uint8_t>* d) {
  constexpr std::size_t kFrame = 36;
  if (d->size() < kFrame + 64) return;
  PutLe(d, 12, d->size());
  if ((*d)[4] != 1) return;
  PutLe(d, 16, d->size() - kFrame);
  (*d)[kFrame + 48] = 0;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  seastitch::DecodeRun("s7k", seastitch::Bytes(data, size), Seal);
  return 0;
}
