#include "codecs/makers/xtf_file.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// Mark and size of the packet.
void Seal(ByteVector* d) {
  if (d->size() < 14) return;
  PutLe(d, 0, 0xFACE, 2);
  PutLe(d, 10, d->size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<XtfFileReader>(); }, Seal);
  return 0;
}
