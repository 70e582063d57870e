#include <cstdlib>
#include <stdexcept>

#include "common/storage/event_log.hpp"
#include "tests/fuzz/memory_file.hpp"

// What is read is loggable, and every byte is either of an event or counted as damaged.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  const MemoryFile file(data, size);
  std::size_t bytes = 0;
  try {
    EventLogReader reader(file.path());
    while (const auto event = reader.Next()) {
      if (!IsLoggable(event->channel, event->data.size())) std::abort();
      bytes += SizeInLog(*event);
    }
    if (bytes + static_cast<std::size_t>(reader.damaged_bytes()) != size) std::abort();
  } catch (const std::runtime_error&) {
    if (bytes > 0) std::abort();  // only the constructor throws
  }
  return 0;
}
