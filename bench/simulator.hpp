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

// CAN signals of the simulated devices: from the drivers' own configuration, so that both agree.
struct DeviceSignals {
  SignalMap imu;
  SignalMap dvl;
};

// Data that reach a driver at the same time.
struct BenchEvent {
  Time recv;  // simulated receive time
  Device device = Device::kImu;
  std::vector<CanFrame> frames;      // kImu: one epoch; kDvl: one ensemble with depth
  std::vector<std::uint8_t> bytes;   // kMbes: one KMALL datagram or part
  std::optional<PositionFix> fix{};  // kFix
};

// Simulates a survey as the bytes that its devices send. Pure: the same config and vehicle give the
// same events. The map is North-East-Down at the datum of the vehicle's geometry. A vehicle that
// does not start at the surface starts at north 0, east 0.
class SurveySimulator {
 public:
  // Throws as LoadRaster.
  SurveySimulator(const SurveyConfig& config,
                  const VehicleGeometry& vehicle,
                  const DeviceSignals& signals);
  ~SurveySimulator();

  // The next event in order of recv; nothing after the end.
  std::optional<BenchEvent> Next();

  // Start of the survey by the devices' clocks.
  Time start() const;
  // True state of the vehicle's reference point, between start() and the end.
  TrueState TruthAt(Time t) const;
  const Terrain& terrain() const;
  Duration total() const;
  // Counts so far: beams with and without a detection, and events lost by faults.
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
