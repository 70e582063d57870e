#include <cstdlib>

#include "drivers/socket/candump.hpp"

// What was read is written and read again as the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  const auto line = ParseCandumpLine({reinterpret_cast<const char*>(data), size});
  if (!line) return 0;
  const auto again = ParseCandumpLine(FormatCandumpLine(*line));
  if (!again || again->frame != line->frame || again->time != line->time) std::abort();
  return 0;
}
