#include <stdexcept>

#include "drivers/can/dbc.hpp"

// A file that is read can decode a frame of every length of every message.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  try {
    const Dbc dbc = Dbc::Parse({reinterpret_cast<const char*>(data), size}, "fuzz.dbc");
    for (const DbcMessage& message : dbc.messages()) {
      CanFrame frame = message.MakeFrame();
      for (frame.length = 0; frame.length <= 64; ++frame.length) dbc.Decode(frame);
      frame.length = 64;
      for (const DbcSignal& signal : message.signals) signal.Put(signal.SaturatedBits(1.0), &frame);
    }
  } catch (const std::runtime_error&) {  // refused with file, line and reason
  }
  return 0;
}
