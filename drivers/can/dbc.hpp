#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/can/can_frame.hpp"

// The part of the DBC format that a driver needs: messages, signals of both byte orders, IEEE
// floats, multiplexing (simple, nested, by ranges), value texts, extended ids, CAN FD lengths.
// Files are Windows-1252 as often as UTF-8: texts become UTF-8.
namespace seastitch {

struct DbcSignal {
  enum class Kind : std::uint8_t { kUnsigned, kSigned, kFloat32, kFloat64 };
  struct Range {
    std::uint64_t first;
    std::uint64_t last;
  };

  std::string name;
  std::string unit;
  int start_bit = 0;  // bit n = byte n / 8, weight 2^(n % 8); least significant (Intel) or most
                      // significant (Motorola) bit of the signal
  int length = 0;     // bits, 1 to 64
  bool motorola = false;
  Kind kind = Kind::kUnsigned;
  double factor = 1.0;  // physical = raw * factor + offset
  double offset = 0.0;
  bool is_switch = false;
  // The signal is there only while the raw value of this one is in one of the ranges, ends
  // included. Empty: it is always there.
  std::string switched_by;
  std::vector<Range> switch_ranges;
  std::map<std::int64_t, std::string> value_texts;  // of raw values

  // The signal's bits, right aligned, or nothing where the data are too short to hold them.
  std::optional<std::uint64_t> Bits(Bytes data) const;
  double Physical(std::uint64_t bits) const;
  // What the raw value is called; empty where it has no text.
  std::string ValueText(std::uint64_t bits) const;
  // The nearest raw value, sign and length respected; out of range (or NaN): nothing.
  std::optional<std::uint64_t> RawBits(double physical) const;
  // The same, but out of range gives the end of the range, as a device does. NaN gives 0.
  std::uint64_t SaturatedBits(double physical) const;
  // Overwrites the signal's bits. The frame must be long enough.
  void Put(std::uint64_t bits, CanFrame* frame) const;
};

// Raw values of a message's switches, by name.
using SwitchPositions = std::map<std::string, std::uint64_t>;

struct DbcMessage {
  std::string name;
  std::uint32_t id = 0;  // without the extended flag
  bool extended = false;
  int length = 0;  // bytes
  std::vector<DbcSignal> signals;

  const DbcSignal* Find(std::string_view signal) const;
  // Nothing where the data are too short to tell.
  std::optional<bool> IsThere(const DbcSignal& signal, Bytes data) const;
  // By which the signal is there: the first of each range list.
  SwitchPositions SwitchesFor(const DbcSignal& signal) const;
  // An empty frame of this message.
  CanFrame MakeFrame() const;
};

class Dbc {
 public:
  // Throw std::runtime_error "FILE:LINE: reason".
  static Dbc Load(const std::string& path);
  static Dbc Parse(std::string_view text, const std::string& file);

  struct Value {
    const DbcSignal* signal;
    double physical;
  };
  struct Decoded {
    const DbcMessage* message;
    std::vector<Value> values;              // signals that are in this frame
    std::vector<const DbcSignal*> missing;  // signals that the frame was too short for
  };
  // Nothing for a frame that is not in the file, and for remote and error frames.
  std::optional<Decoded> Decode(const CanFrame& frame) const;

  // Signals that are not named are 0; a multiplexed one sets the switches that are not named.
  // Throws std::runtime_error for an unknown name and for a value that the signal cannot hold.
  CanFrame Encode(const std::string& message, const std::map<std::string, double>& values) const;

  const DbcMessage* Find(std::uint32_t id, bool extended) const;
  const DbcMessage* Find(std::string_view message) const;
  const std::vector<DbcMessage>& messages() const { return messages_; }

 private:
  std::vector<DbcMessage> messages_;  // in file order
  std::map<CanFilter, std::size_t> index_;
};

}  // namespace seastitch
