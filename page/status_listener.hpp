#pragma once

#include <optional>

#include "common/runtime/bus.hpp"
#include "page/vehicle_status.hpp"

namespace seastitch {

// Listens to what the processes of a vehicle say of themselves, and where the vehicle is.
class StatusListener {
 public:
  // Subscribes to HEALTH, NAV_CORRECTED and DVL, whose altitude it takes. The bus outlives it.
  explicit StatusListener(Bus* bus);
  StatusListener(const StatusListener&) = delete;
  StatusListener& operator=(const StatusListener&) = delete;

  // What holds now. It refers to this object.
  StatusView View() const;

 private:
  ProcessRoll roll_;
  std::optional<nav_corrected_t> nav_;
  std::optional<double> altitude_m_;
  double nav_s_ = 0.0, altitude_s_ = 0.0;  // when they were heard
};

}  // namespace seastitch
