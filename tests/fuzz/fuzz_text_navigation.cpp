// Text beside survey files: navigation, and sound speed profiles.
#include "codecs/navigation/text_navigation.hpp"

#include <cstdlib>

#include "codecs/profile_text.hpp"
#include "tests/fuzz/survey_file.hpp"

namespace {

using namespace seastitch;

// Every quantity has a column.
TextNavigationFormat Format() {
  TextNavigationFormat format;
  format.delimiter = ',';
  std::size_t column = 0;
  for (const char* quantity : {"iso",
                               "latitude",
                               "longitude",
                               "north",
                               "east",
                               "depth",
                               "height",
                               "heading",
                               "roll",
                               "pitch",
                               "heave",
                               "epoch"})
    format.columns.push_back({quantity, column++});
  return format;
}

void Seal(ByteVector*) {}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzSurveyFile(
      Bytes(data, size), [] { return std::make_unique<TextNavigationReader>(Format()); }, Seal);
  const ProfileText profiles =
      ParseProfileText(std::string_view(reinterpret_cast<const char*>(data), size));
  for (const ProfileCast& cast : profiles.casts)
    if (cast.profile.depth_m.size() < 2) std::abort();
  return 0;
}
