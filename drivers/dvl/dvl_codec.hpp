#pragma once

#include <optional>
#include <vector>

#include "common/core/health/counters.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"

namespace seastitch {

struct DvlOutput {
  std::optional<DvlSample> dvl;
  std::optional<DepthSample> depth;
};

// Interface of the data formats of DVLs on CAN. A format is one pair of files, and one line in
// dvl_driver.cpp.
class DvlCodec {
 public:
  virtual ~DvlCodec() = default;

  virtual DvlOutput Add(const CanFrame& frame, Time recv) = 0;
  // Call it at the end of a log: counts an incomplete ensemble.
  virtual void Finish() {}

  // Invalid and lost frames and ensembles, by cause.
  virtual Counters counters() const = 0;
  virtual Counters clock_figures() const = 0;
  virtual std::vector<CanFilter> filters() const = 0;
};

}  // namespace seastitch
