#include "drivers/can/dbc.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "drivers/can/dbc_parser.hpp"

namespace seastitch {
namespace {

// Number of the next bit of a signal: an Intel signal is read from its least significant bit, a
// Motorola signal from its most significant one. Numbering: DbcSignal::start_bit.
int NextBit(int bit, bool motorola) {
  if (!motorola) return bit + 1;
  return bit % 8 == 0 ? bit + 15 : bit - 1;
}

std::uint64_t Mask(int length) { return length >= 64 ? ~0ULL : (1ULL << length) - 1; }

std::int64_t SignExtend(std::uint64_t bits, int length) {
  const std::uint64_t sign = 1ULL << (length - 1);
  return static_cast<std::int64_t>((bits ^ sign) - sign);
}

struct RawRange {
  double lowest;
  // first value above the range; the highest value itself may not be exact in double
  double beyond;
};

RawRange RangeOf(const DbcSignal& signal) {
  if (signal.kind == DbcSignal::Kind::kSigned)
    return {-std::ldexp(1.0, signal.length - 1), std::ldexp(1.0, signal.length - 1)};
  return {0.0, std::ldexp(1.0, signal.length)};
}

std::uint64_t IntegerBits(const DbcSignal& signal, double raw) {
  if (signal.kind == DbcSignal::Kind::kSigned)
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(raw)) & Mask(signal.length);
  return static_cast<std::uint64_t>(raw);
}

std::uint64_t FloatBits(const DbcSignal& signal, double raw) {
  return signal.kind == DbcSignal::Kind::kFloat32
             ? std::bit_cast<std::uint32_t>(static_cast<float>(raw))
             : std::bit_cast<std::uint64_t>(raw);
}

bool IsFloat(const DbcSignal& signal) {
  return signal.kind == DbcSignal::Kind::kFloat32 || signal.kind == DbcSignal::Kind::kFloat64;
}

}  // namespace

int DbcSignal::BytesNeeded() const {
  if (!motorola) return (start_bit + length + 7) / 8;
  const int beyond_first_byte = length - (start_bit % 8 + 1);
  return start_bit / 8 + 1 + (std::max(beyond_first_byte, 0) + 7) / 8;
}

std::optional<std::uint64_t> DbcSignal::Bits(Bytes data) const {
  if (static_cast<std::size_t>(BytesNeeded()) > data.size()) return std::nullopt;
  std::uint64_t bits = 0;
  int bit = start_bit;
  for (int i = 0; i < length; ++i, bit = NextBit(bit, motorola)) {
    const std::uint64_t one = (data[static_cast<std::size_t>(bit / 8)] >> (bit % 8)) & 1U;
    bits |= one << (motorola ? length - 1 - i : i);
  }
  return bits;
}

void DbcSignal::Put(std::uint64_t bits, CanFrame* frame) const {
  int bit = start_bit;
  for (int i = 0; i < length; ++i, bit = NextBit(bit, motorola)) {
    const std::uint64_t one = (bits >> (motorola ? length - 1 - i : i)) & 1U;
    std::uint8_t& byte = frame->bytes[static_cast<std::size_t>(bit / 8)];
    byte = static_cast<std::uint8_t>((byte & ~(1U << (bit % 8))) | (one << (bit % 8)));
  }
}

double DbcSignal::Physical(std::uint64_t bits) const {
  double raw = 0.0;
  switch (kind) {
    case Kind::kUnsigned: raw = static_cast<double>(bits); break;
    case Kind::kSigned: raw = static_cast<double>(SignExtend(bits, length)); break;
    case Kind::kFloat32: raw = std::bit_cast<float>(static_cast<std::uint32_t>(bits)); break;
    case Kind::kFloat64: raw = std::bit_cast<double>(bits); break;
  }
  return raw * factor + offset;
}

std::string DbcSignal::ValueText(std::uint64_t bits) const {
  const std::int64_t raw =
      kind == Kind::kSigned ? SignExtend(bits, length) : static_cast<std::int64_t>(bits);
  const auto found = value_texts.find(raw);
  return found == value_texts.end() ? "" : found->second;
}

std::optional<std::uint64_t> DbcSignal::RawBits(double physical) const {
  const double raw = (physical - offset) / factor;
  if (IsFloat(*this)) return FloatBits(*this, raw);
  const double rounded = std::nearbyint(raw);
  const RawRange range = RangeOf(*this);
  if (!(rounded >= range.lowest && rounded < range.beyond)) return std::nullopt;
  return IntegerBits(*this, rounded);
}

std::uint64_t DbcSignal::SaturatedBits(double physical) const {
  if (const std::optional<std::uint64_t> bits = RawBits(physical)) return *bits;
  const double raw = (physical - offset) / factor;
  if (std::isnan(raw)) return 0;
  if (kind == Kind::kSigned) return raw < 0.0 ? 1ULL << (length - 1) : Mask(length - 1);
  return raw < 0.0 ? 0 : Mask(length);
}

const DbcSignal* DbcMessage::Find(std::string_view signal) const {
  for (const DbcSignal& candidate : signals)
    if (candidate.name == signal) return &candidate;
  return nullptr;
}

std::optional<bool> DbcMessage::IsThere(const DbcSignal& signal, Bytes data) const {
  if (signal.switched_by.empty()) return true;
  const DbcSignal& by = *Find(signal.switched_by);
  const std::optional<bool> switch_is_there = IsThere(by, data);
  if (switch_is_there != true) return switch_is_there;
  const std::optional<std::uint64_t> value = by.Bits(data);
  if (!value) return std::nullopt;
  return std::any_of(
      signal.switch_ranges.begin(), signal.switch_ranges.end(), [&value](const auto& range) {
        return range.first <= *value && *value <= range.last;
      });
}

SwitchPositions DbcMessage::SwitchesFor(const DbcSignal& signal) const {
  SwitchPositions positions;
  for (const DbcSignal* s = &signal; !s->switched_by.empty(); s = Find(s->switched_by))
    positions[s->switched_by] = s->switch_ranges.front().first;
  return positions;
}

CanFrame DbcMessage::MakeFrame() const {
  CanFrame frame;
  frame.id = id;
  frame.extended = extended;
  frame.fd = length > 8;
  frame.length = static_cast<std::uint8_t>(length);
  return frame;
}

Dbc Dbc::Load(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (in.peek() != std::ifstream::traits_type::eof()) text << in.rdbuf();
  if (!in || !text) throw std::runtime_error(path + ":0: not a file that can be read");
  return Parse(text.str(), path);
}

Dbc Dbc::Parse(std::string_view text, const std::string& file) {
  Dbc dbc;
  dbc.messages_ = ParseDbc(text, file);
  for (std::size_t i = 0; i < dbc.messages_.size(); ++i)
    dbc.index_[{dbc.messages_[i].id, dbc.messages_[i].extended}] = i;
  return dbc;
}

std::optional<Dbc::Decoded> Dbc::Decode(const CanFrame& frame) const {
  const DbcMessage* const message =
      frame.remote || frame.error ? nullptr : Find(frame.id, frame.extended);
  if (message == nullptr) return std::nullopt;
  Decoded decoded{message, {}, {}};
  for (const DbcSignal& signal : message->signals) {
    const std::optional<bool> there = message->IsThere(signal, frame.data());
    if (there == false) continue;
    const std::optional<std::uint64_t> bits = there ? signal.Bits(frame.data()) : std::nullopt;
    if (bits)
      decoded.values.push_back({&signal, signal.Physical(*bits)});
    else
      decoded.missing.push_back(&signal);
  }
  return decoded;
}

CanFrame Dbc::Encode(const std::string& name, const std::map<std::string, double>& values) const {
  const DbcMessage* const message = Find(name);
  if (message == nullptr) throw std::runtime_error(name + ": no such message");
  CanFrame frame = message->MakeFrame();
  for (const auto& [signal_name, physical] : values) {
    const DbcSignal* const signal = message->Find(signal_name);
    if (signal == nullptr) throw std::runtime_error(name + "." + signal_name + ": no such signal");
    const std::optional<std::uint64_t> bits = signal->RawBits(physical);
    if (!bits)
      throw std::runtime_error(name + "." + signal_name + " cannot hold " +
                               std::to_string(physical));
    signal->Put(*bits, &frame);
    for (const auto& [name_of_switch, value] : message->SwitchesFor(*signal))
      if (!values.contains(name_of_switch)) message->Find(name_of_switch)->Put(value, &frame);
  }
  return frame;
}

const DbcMessage* Dbc::Find(std::uint32_t id, bool extended) const {
  const auto found = index_.find({id, extended});
  return found == index_.end() ? nullptr : &messages_[found->second];
}

const DbcMessage* Dbc::Find(std::string_view message) const {
  for (const DbcMessage& candidate : messages_)
    if (candidate.name == message) return &candidate;
  return nullptr;
}

}  // namespace seastitch
