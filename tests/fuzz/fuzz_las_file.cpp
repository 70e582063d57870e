#include "codecs/lines/las_file.hpp"
#include "tests/codecs/one_each.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// A record that is long enough becomes a head of its version and point format, with no more than
// itself before the points.
void Seal(ByteVector* record) {
  constexpr std::size_t kShortest = 227, kLongest = 375;
  if (record->size() < kShortest) return;
  const std::size_t minor = (*record)[25] % 5;
  const std::size_t format = (*record)[104] % 11;
  constexpr std::size_t kPointBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  PutLe(record, 0, 0x4653414C);  // LASF
  PutLe(record, 24, 1, 1);
  PutLe(record, 25, minor, 1);
  PutLe(record, 94, minor == 4 ? std::min(kLongest, record->size()) : kShortest, 2);
  PutLe(record, 96, record->size());
  PutLe(record, 104, format, 1);
  PutLe(record, 105, kPointBytes[format] + (*record)[106] % 4, 2);
  for (std::size_t axis = 0; axis < 3; ++axis) PutLe(record, 131 + 8 * axis + 6, 0x3F50, 2);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size),
      [] { return std::make_unique<LasFileReader>(std::make_unique<OneEach>()); },
      Seal);
  return 0;
}
