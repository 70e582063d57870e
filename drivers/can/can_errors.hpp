#pragma once

#include <cstdint>
#include <string>

#include "common/core/health/counters.hpp"
#include "drivers/can/can_frame.hpp"

namespace seastitch {

// Evaluates the error frames of a CAN interface (linux/can/error.h): errors on the wire, and the
// state of this computer's controller.
class CanErrors {
 public:
  // An error frame.
  void Add(const CanFrame& error);
  // Any other frame: a controller that is off the bus receives none.
  void SeeData();

  // CanSource::outages(): after its interface was down or gone the controller begins anew, and
  // sends no frame to say so.
  void SeeOutages(std::int64_t outages);

  // For people, such as "controller is bus-off"; empty where it takes its full part.
  std::string trouble() const;

  // can_error_frames, and of those can_bus_off, can_error_passive, can_error_warning,
  // can_restarted, can_no_ack, can_protocol_errors, can_controller_overflows.
  const Counters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t { kActive, kWarning, kPassive, kBusOff };
  void Controller(std::uint8_t status);
  void Enter(State state, const char* counter);

  State state_ = State::kActive;
  std::int64_t outages_ = 0;  // of the interface
  Counters counters_;
};

}  // namespace seastitch
