#include "drivers/can/can_errors.hpp"

namespace seastitch {
namespace {

// Error classes: bits of the identifier.
constexpr std::uint32_t kController = 0x004;  // status in byte 1
constexpr std::uint32_t kProtocol = 0x008;
constexpr std::uint32_t kNoAcknowledge = 0x020;
constexpr std::uint32_t kBusOff = 0x040;
constexpr std::uint32_t kBusError = 0x080;
constexpr std::uint32_t kRestarted = 0x100;

// Status of the controller: two bits each, for receive and transmit.
constexpr std::uint8_t kOverflow = 0x03;
constexpr std::uint8_t kWarning = 0x0C;
constexpr std::uint8_t kPassive = 0x30;
constexpr std::uint8_t kActive = 0x40;

}  // namespace

void CanErrors::Add(const CanFrame& error) {
  ++counters_["can_error_frames"];
  if ((error.id & kController) != 0 && error.length > 1) Controller(error.bytes[1]);
  if ((error.id & (kProtocol | kBusError)) != 0) ++counters_["can_protocol_errors"];
  if ((error.id & kNoAcknowledge) != 0) ++counters_["can_no_ack"];
  if ((error.id & kBusOff) != 0) Enter(State::kBusOff, "can_bus_off");
  if ((error.id & kRestarted) != 0) Enter(State::kActive, "can_restarted");
}

void CanErrors::SeeData() {
  if (state_ == State::kBusOff) state_ = State::kActive;
}

void CanErrors::SeeOutages(std::int64_t outages) {
  if (outages != outages_) state_ = State::kActive;
  outages_ = outages;
}

void CanErrors::Controller(std::uint8_t status) {
  if ((status & kOverflow) != 0) ++counters_["can_controller_overflows"];
  if ((status & kPassive) != 0)
    Enter(State::kPassive, "can_error_passive");
  else if ((status & kWarning) != 0)
    Enter(State::kWarning, "can_error_warning");
  else if ((status & kActive) != 0)
    state_ = State::kActive;
}

void CanErrors::Enter(State state, const char* counter) {
  ++counters_[counter];
  state_ = state;
}

std::string CanErrors::trouble() const {
  switch (state_) {
    case State::kActive: return "";
    case State::kWarning: return "controller counts many errors";
    case State::kPassive: return "controller is error-passive";
    case State::kBusOff: return "controller is bus-off";
  }
  return "";
}

}  // namespace seastitch
