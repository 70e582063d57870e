#include "drivers/can/signal_map.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace seastitch {
namespace {

constexpr char kExpected[] = "expected MESSAGE.SIGNAL or MESSAGE.SIGNAL * FACTOR [+ OFFSET]";

struct SignalText {
  std::string message;
  std::string signal;
  double scale = 1.0;
  double offset = 0.0;
};

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

std::runtime_error Problem(const std::string& text, const char* reason) {
  return std::runtime_error("'" + text + "': " + reason);
}

double ParseNumber(const std::string& text, std::string_view number) {
  double value = 0.0;
  const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (error != std::errc() || stop != number.data() + number.size() || !std::isfinite(value))
    throw Problem(text, kExpected);
  return value;
}

SignalText ParseSignalText(const std::string& text) {
  SignalText parsed;
  std::string_view name = Trimmed(text);
  if (const std::size_t star = name.find('*'); star != std::string_view::npos) {
    std::string_view factor = Trimmed(name.substr(star + 1));
    name = Trimmed(name.substr(0, star));
    if (const std::size_t plus = factor.find(" + "); plus != std::string_view::npos) {
      parsed.offset = ParseNumber(text, Trimmed(factor.substr(plus + 3)));
      factor = Trimmed(factor.substr(0, plus));
    }
    parsed.scale = ParseNumber(text, factor);
    if (parsed.scale == 0.0) throw Problem(text, kExpected);
  }
  const std::size_t dot = name.find('.');
  if (dot == std::string_view::npos) throw Problem(text, kExpected);
  parsed.message = name.substr(0, dot);
  parsed.signal = name.substr(dot + 1);
  return parsed;
}

CanFilter FilterOf(const DbcMessage& message) { return {message.id, message.extended}; }

}  // namespace

void SignalMap::Assign(const Dbc& dbc, std::size_t field, const std::string& text) {
  const SignalText wanted = ParseSignalText(text);
  const DbcMessage* const layout = dbc.Find(wanted.message);
  if (layout == nullptr) throw Problem(text, "no such message in the DBC file");
  if (layout->Find(wanted.signal) == nullptr) throw Problem(text, "no such signal in the DBC file");
  auto at = std::lower_bound(
      messages_.begin(), messages_.end(), FilterOf(*layout), [](const Message& m, CanFilter id) {
        return FilterOf(*m.layout) < id;
      });
  if (at == messages_.end() || FilterOf(*at->layout) != FilterOf(*layout))
    at = messages_.insert(at, Message{std::make_shared<const DbcMessage>(*layout), {}});
  at->bindings.push_back({field, at->layout->Find(wanted.signal), wanted.scale, wanted.offset});
  assigned_.set(field);
}

double SignalMap::Resolution(std::size_t field) const {
  for (const Message& message : messages_)
    for (const Binding& binding : message.bindings)
      if (binding.field == field) return std::abs(binding.signal->factor * binding.scale);
  return 0.0;
}

std::vector<CanFilter> SignalMap::Filters() const {
  std::vector<CanFilter> filters;
  for (const Message& message : messages_) filters.push_back(FilterOf(*message.layout));
  return filters;
}

const SignalMap::Message* SignalMap::Find(const CanFrame& frame) const {
  if (frame.remote || frame.error) return nullptr;
  for (const Message& message : messages_)
    if (message.layout->id == frame.id && message.layout->extended == frame.extended)
      return &message;
  return nullptr;
}

std::optional<SignalMap::Reading> SignalMap::Read(const CanFrame& frame) const {
  const Message* const message = Find(frame);
  if (message == nullptr) return std::nullopt;
  Reading reading;
  for (const Binding& binding : message->bindings) {
    const std::optional<bool> there = message->layout->IsThere(*binding.signal, frame.data());
    if (there == false) continue;
    const std::optional<std::uint64_t> bits =
        there ? binding.signal->Bits(frame.data()) : std::nullopt;
    const double value =
        bits ? binding.signal->Physical(*bits) * binding.scale + binding.offset : NAN;
    if (std::isfinite(value))
      reading.values.Set(binding.field, value);
    else
      reading.complete = false;
  }
  return reading;
}

std::vector<CanFrame> SignalMap::Write(const FieldValues& values) const {
  std::vector<CanFrame> frames;
  for (const Message& message : messages_) {
    // Each combination of switch positions needs a frame of its own.
    std::set<SwitchPositions> positions;
    bool any = false;
    for (const Binding& binding : message.bindings) {
      if (!values.present.test(binding.field)) continue;
      any = true;
      SwitchPositions switches = message.layout->SwitchesFor(*binding.signal);
      if (!switches.empty()) positions.insert(std::move(switches));
    }
    if (!any) continue;
    if (positions.empty()) positions.insert(SwitchPositions());
    for (const SwitchPositions& switches : positions) {
      CanFrame frame = message.layout->MakeFrame();
      for (const auto& [name, value] : switches) message.layout->Find(name)->Put(value, &frame);
      for (const Binding& binding : message.bindings) {
        if (!values.present.test(binding.field)) continue;
        if (message.layout->IsThere(*binding.signal, frame.data()) != true) continue;
        const double physical = (values.value[binding.field] - binding.offset) / binding.scale;
        binding.signal->Put(binding.signal->SaturatedBits(physical), &frame);
      }
      frames.push_back(frame);
    }
  }
  return frames;
}

}  // namespace seastitch
