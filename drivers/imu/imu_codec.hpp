#pragma once

#include <optional>
#include <vector>

#include "common/core/counters.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"

namespace seastitch {

// How an inertial unit speaks on CAN. One pair of files a protocol, and one line in
// imu_driver.cpp.
class ImuCodec {
 public:
  virtual ~ImuCodec() = default;

  // Adds a frame. Gives the epoch that it completed, or the one before it where it opens the next.
  virtual std::optional<ImuSample> Add(const CanFrame& frame, Time recv) = 0;
  // Ends the open epoch: at the end of a log.
  virtual std::optional<ImuSample> Finish() { return std::nullopt; }
  // Receive stamp of the last frame of the epoch that was given last.
  virtual Time epoch_recv() const = 0;

  // What was refused or lost, by cause.
  virtual Counters counters() const = 0;
  virtual Counters clock_figures() const = 0;
  virtual std::vector<CanFilter> filters() const = 0;
};

}  // namespace seastitch
