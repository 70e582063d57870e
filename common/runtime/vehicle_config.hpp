#pragma once

#include <string>

#include "common/core/vehicle.hpp"

namespace seastitch {

// Reads config/vehicle.yaml: lever arms in metres, mounting angles in degrees, datum in degrees.
// Throws ConfigError.
VehicleGeometry LoadVehicle(const std::string& path);

}  // namespace seastitch
