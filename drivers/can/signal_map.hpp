#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/dbc.hpp"

namespace seastitch {

constexpr std::size_t kMaxFields = 32;

// Values of a decoder's fields, numbered by the decoder's own enum.
struct FieldValues {
  std::array<double, kMaxFields> value{};
  std::bitset<kMaxFields> present;

  void Set(std::size_t field, double v) {
    value[field] = v;
    present.set(field);
  }
};

// Maps the signals of CAN messages to a decoder's fields, one signal per field.
class SignalMap {
 public:
  // `text` is "MESSAGE.SIGNAL" or, to reverse an axis or convert a unit, "MESSAGE.SIGNAL * FACTOR"
  // or "MESSAGE.SIGNAL * FACTOR + OFFSET". Throws std::runtime_error "'IMU_GYRO.GYRO_Q': no such
  // signal in the DBC file".
  void Assign(const Dbc& dbc, std::size_t field, const std::string& text);

  bool Has(std::size_t field) const { return assigned_.test(field); }
  // Resolution of the field's signal, in the field's unit. 0 if no signal is mapped.
  double Resolution(std::size_t field) const;
  // The messages that have a field, each once, sorted.
  std::vector<CanFilter> Filters() const;

  struct Reading {
    FieldValues values;
    bool complete = true;  // false: too short for a field, or not a finite number
  };
  // Nothing for a frame that fills no field.
  std::optional<Reading> Read(const CanFrame& frame) const;

  // One frame for each message that has one of the values, in the order of ids. Values beyond what
  // a signal holds saturate.
  std::vector<CanFrame> Write(const FieldValues& values) const;

 private:
  struct Binding {
    std::size_t field;
    const DbcSignal* signal;  // of the message's layout
    double scale;             // field = physical * scale + offset
    double offset;
  };
  struct Message {
    std::shared_ptr<const DbcMessage> layout;  // shared by copies of the map
    std::vector<Binding> bindings;
  };
  const Message* Find(const CanFrame& frame) const;

  std::vector<Message> messages_;  // sorted by id
  std::bitset<kMaxFields> assigned_;
};

}  // namespace seastitch
