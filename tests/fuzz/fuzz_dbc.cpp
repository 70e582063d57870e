#include <initializer_list>
#include <stdexcept>

#include "drivers/can/dbc.hpp"

// A file that is read can decode frames of each of its messages, also too short ones.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  try {
    const Dbc dbc = Dbc::Parse({reinterpret_cast<const char*>(data), size}, "fuzz.dbc");
    for (const DbcMessage& message : dbc.messages()) {
      CanFrame frame = message.MakeFrame();
      for (const std::uint8_t length : std::initializer_list<std::uint8_t>{0, 1, 7, 8, 63, 64}) {
        frame.length = length;
        dbc.Decode(frame);
      }
      for (const DbcSignal& signal : message.signals) signal.Put(signal.SaturatedBits(1.0), &frame);
    }
  } catch (const std::runtime_error&) {  // refused with file, line and reason
  }
  return 0;
}
