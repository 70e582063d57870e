#include "codecs/kongsberg/em_all_file.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// Length, STX, a date, ETX and checksum.
void Seal(ByteVector* d) {
  if (d->size() < 23) return;
  const std::size_t end = d->size() - 3;
  PutLe(d, 0, d->size() - 4);
  (*d)[4] = 2;
  PutLe(d, 8, 20231231);
  PutLe(d, 14, 0, 2);
  (*d)[end] = 3;
  std::size_t sum = 0;
  for (std::size_t i = 5; i < end; ++i) sum += (*d)[i];
  PutLe(d, end + 1, sum, 2);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<EmAllFileReader>(); }, Seal);
  return 0;
}
