#pragma once

#include <optional>
#include <vector>

#include "common/core/health/counters.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"

namespace seastitch {

// Interface of the data formats of inertial units on CAN. A format is one pair of files, and one
// line in imu_driver.cpp.
class ImuCodec {
 public:
  virtual ~ImuCodec() = default;

  // Adds a frame. Returns the epoch that it completes, or the previous epoch if it begins a new
  // one.
  virtual std::optional<ImuSample> Add(const CanFrame& frame, Time recv) = 0;
  // Call it at the end of a log: returns the open epoch if it has its inertial
  // part.
  virtual std::optional<ImuSample> Finish() { return std::nullopt; }
  // Receive stamp of the last frame of the last returned epoch.
  virtual Time epoch_recv() const = 0;

  // Invalid and lost frames and epochs, by cause.
  virtual Counters counters() const = 0;
  virtual Counters clock_figures() const = 0;
  virtual std::vector<CanFilter> filters() const = 0;
};

}  // namespace seastitch
