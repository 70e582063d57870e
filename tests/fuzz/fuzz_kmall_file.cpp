#include "codecs/kongsberg/kmall_file.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// The two length words.
void Seal(ByteVector* d) {
  if (d->size() < 8) return;
  PutLe(d, 0, d->size());
  PutLe(d, d->size() - 4, d->size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<KmallFileReader>(); }, Seal);
  return 0;
}
