#include "codecs/makers/cereal_file.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

void Seal(ByteVector*) {}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<CerealFileReader>(); }, Seal);
  return 0;
}
