#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "bench/survey_config.hpp"
#include "bench/trajectory.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/can/signal_map.hpp"

namespace seastitch::bench {

// Which CAN signal carries what: of the drivers' own configuration, so that both sides agree.
struct DeviceSignals {
  SignalMap imu;
  SignalMap dvl;
};

// What reaches a driver at once.
struct BenchEvent {
  Time recv;  // simulated
  Device device = Device::kImu;
  std::vector<CanFrame> frames;      // kImu: one epoch; kDvl: one ensemble with depth
  std::vector<std::uint8_t> bytes;   // kMbes: one KMALL datagram or part
  std::optional<PositionFix> fix{};  // kFix
};

// A survey as the bytes that its devices send. Pure: the same config and vehicle give the same
// events. The map is North-East-Down at the datum of the vehicle's geometry; a vehicle that does
// not come from the surface starts at north 0, east 0 of it.
class SurveySimulator {
 public:
  // Throws what LoadRaster throws.
  SurveySimulator(const SurveyConfig& config,
                  const VehicleGeometry& vehicle,
                  const DeviceSignals& signals);
  ~SurveySimulator();

  // The next event in order of recv; nothing when the survey is over.
  std::optional<BenchEvent> Next();

  // When the survey begins, by the devices' own clocks.
  Time start() const;
  // Of the vehicle's reference point, between start() and its end.
  TrueState TruthAt(Time t) const;
  const Terrain& terrain() const;
  Duration total() const;
  // So far: beams with a detection, beams without, and events that a fault took.
  struct Counts {
    std::int64_t pings = 0;
    std::int64_t soundings = 0;
    std::int64_t beams_without_detection = 0;
    std::int64_t events_lost = 0;
  };
  const Counts& counts() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch::bench
