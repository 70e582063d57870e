#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/can/can_frame.hpp"

// The part of the DBC format that a driver needs: messages, signals of both byte orders, IEEE
// floats, multiplexing (simple, and extended: SG_MUL_VAL_), value descriptions (VAL_), extended
// ids, CAN FD lengths. The encoding, Windows-1252 or UTF-8, is detected; texts are returned as
// UTF-8.
namespace seastitch {

struct DbcSignal {
  enum class Kind : std::uint8_t { kUnsigned, kSigned, kFloat32, kFloat64 };
  struct Range {
    std::uint64_t first;
    std::uint64_t last;
  };

  std::string name;
  std::string unit;
  // Position of the signal's least significant bit (Intel) or most significant bit (Motorola). Bit
  // n is in byte n / 8 and has the weight 2^(n % 8) there.
  int start_bit = 0;
  int length = 0;         // bits, 1 to 64
  bool motorola = false;  // big-endian
  Kind kind = Kind::kUnsigned;
  double factor = 1.0;  // physical = raw * factor + offset
  double offset = 0.0;
  bool is_switch = false;  // a multiplexer signal
  // Multiplexer signal of this signal, which is present only while the multiplexer's raw value is
  // in one of the ranges, ends included. Empty: always present.
  std::string switched_by;
  std::vector<Range> switch_ranges;
  std::map<std::int64_t, std::string> value_texts;  // of raw values

  // Number of bytes up to and including the last one that the signal uses.
  int BytesNeeded() const;
  // The signal's bits, right aligned, or nothing where the data are too short to hold them.
  std::optional<std::uint64_t> Bits(Bytes data) const;
  double Physical(std::uint64_t bits) const;
  // What the raw value is called; empty where it has no text.
  std::string ValueText(std::uint64_t bits) const;
  // The nearest raw value. Nothing if it does not fit the signal's sign and length, and for NaN.
  std::optional<std::uint64_t> RawBits(double physical) const;
  // The same, saturated: a value out of range becomes the nearest limit, NaN becomes 0.
  std::uint64_t SaturatedBits(double physical) const;
  // Overwrites the signal's bits. The frame must be long enough.
  void Put(std::uint64_t bits, CanFrame* frame) const;
};

// Raw values of a message's multiplexer signals, by name.
using SwitchPositions = std::map<std::string, std::uint64_t>;

struct DbcMessage {
  std::string name;
  std::uint32_t id = 0;  // without the extended flag
  bool extended = false;
  int length = 0;  // bytes
  std::vector<DbcSignal> signals;

  const DbcSignal* Find(std::string_view signal) const;
  // Whether a multiplexed signal is present. Nothing if the data are too short for its multiplexer.
  std::optional<bool> IsThere(const DbcSignal& signal, Bytes data) const;
  // Multiplexer values with which the signal is present: the first value of the first range of
  // each.
  SwitchPositions SwitchesFor(const DbcSignal& signal) const;
  // A frame of this message with all bytes 0.
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

  // values: physical values by signal name. The bits of other signals are 0. For a multiplexed
  // signal its multiplexers are set too, unless they are named.
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
