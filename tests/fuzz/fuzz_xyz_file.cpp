#include "codecs/lines/xyz_file.hpp"
#include "tests/codecs/one_each.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// Every quantity that may stand beside the others has a column.
XyzFormat Format() {
  XyzFormat format;
  format.delimiter = ',';
  std::size_t column = 0;
  for (const char* quantity : {"iso", "longitude", "latitude", "depth", "line", "used"})
    format.columns.push_back({quantity, column++});
  return format;
}

void Seal(ByteVector*) {}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size),
      [] { return std::make_unique<XyzFileReader>(Format(), std::make_unique<OneEach>()); },
      Seal);
  return 0;
}
