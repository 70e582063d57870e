#include <cstdlib>

#include "drivers/socket/cannelloni.hpp"

// What was read is written and read again as the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  const auto packet = DecodeCannelloni(Bytes(data, size));
  if (!packet) return 0;
  const auto again = DecodeCannelloni(EncodeCannelloni(packet->frames, packet->seq));
  if (!again || again->frames != packet->frames || again->seq != packet->seq) std::abort();
  return 0;
}
