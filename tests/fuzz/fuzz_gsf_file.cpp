#include "codecs/makers/gsf_file.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// Size, in steps of four bytes; no checksum.
void Seal(ByteVector* d) {
  if (d->size() < 12) return;
  d->resize(d->size() / 4 * 4);
  const std::size_t size = d->size() - 8;
  for (std::size_t i = 0; i < 4; ++i) (*d)[i] = static_cast<std::uint8_t>(size >> (24 - 8 * i));
  (*d)[4] = (*d)[5] = (*d)[6] = 0;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<GsfFileReader>(); }, Seal);
  return 0;
}
