#include <cstdlib>
#include <initializer_list>
#include <stdexcept>

#include "drivers/can/signal_map.hpp"

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
      for (const DbcSignal& signal : message.signals) {
        signal.ValueText(signal.SaturatedBits(1.0));
        SignalMap map;
        map.Assign(dbc, 0, message.name + "." + signal.name);
        FieldValues values;
        values.Set(0, 1.0);
        // What was written is there when it is read.
        for (const CanFrame& written : map.Write(values))
          if (!map.Read(written)) std::abort();
      }
    }
  } catch (const std::runtime_error&) {  // refused with file, line and reason
  }
  return 0;
}
