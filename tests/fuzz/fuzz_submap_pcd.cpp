#include <stdexcept>

#include "common/storage/submap_file.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  const MemoryFile file(data, size);
  try {
    ReadSubmapPcd(file.path());
  } catch (const std::runtime_error&) {  // one line, as for any file that cannot be used
  }
  return 0;
}
