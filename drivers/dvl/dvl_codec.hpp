#pragma once

#include <optional>
#include <vector>

#include "common/core/counters.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"

namespace seastitch {

struct DvlOutput {
  std::optional<DvlSample> dvl;
  std::optional<DepthSample> depth;
};

// How a Doppler log speaks on CAN. One pair of files a protocol, and one line in dvl_driver.cpp.
class DvlCodec {
 public:
  virtual ~DvlCodec() = default;

  virtual DvlOutput Add(const CanFrame& frame, Time recv) = 0;
  // Counts what is still unfinished: at the end of a log.
  virtual void Finish() {}

  // What was refused or lost, by cause.
  virtual Counters counters() const = 0;
  virtual Counters clock_figures() const = 0;
  virtual std::vector<CanFilter> filters() const = 0;
};

}  // namespace seastitch
