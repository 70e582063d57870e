#include "codecs/makers/wbms.hpp"
#include "tests/fuzz/mbes_stream.hpp"

namespace {

using namespace seastitch;

void PutLe(std::vector<std::uint8_t>* d, std::size_t at, std::size_t value) {
  for (std::size_t i = 0; i < 4; ++i) (*d)[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

// Preamble and size; then the sum, which a packet of such bytes would have.
void Seal(std::vector<std::uint8_t>* d) {
  if (d->size() < 25 || (*d)[0] % 8 == 0) return;  // as it is, now and then
  PutLe(d, 0, 0xDEADBEEF);
  PutLe(d, 8, d->size());
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = 24; i < d->size(); ++i) {
    crc ^= (*d)[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? 0xEDB88320u ^ (crc >> 1) : crc >> 1;
  }
  PutLe(d, 20, ~crc);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  seastitch::DecodeRun("wbms", seastitch::Bytes(data, size), Seal);
  return 0;
}
