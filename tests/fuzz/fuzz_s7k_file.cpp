#include "codecs/makers/s7k_file.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// Version, sync pattern and size; no checksum.
void Seal(ByteVector* d) {
  if (d->size() < 68) return;
  PutLe(d, 0, 5, 2);
  PutLe(d, 4, 0xFFFF);
  PutLe(d, 8, d->size());
  (*d)[48] = 0;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<S7kFileReader>(); }, Seal);
  return 0;
}
