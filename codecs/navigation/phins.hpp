#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "codecs/navigation/nmea0183.hpp"
#include "common/core/bytes.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

// iXblue's standard binary protocol, versions 2 to 5, big-endian: one navigation solution of an INS
// (PHINS, ROVINS, ...) per frame. Unused blocks are skipped by their sizes.
namespace seastitch {

struct PhinsFrame {
  int version = 0;
  Duration valid_at{};           // since midnight, where the INS is synchronised to UTC
  std::uint32_t counter = 0;     // frame number
  std::optional<Time> midnight;  // of the day
  std::optional<Attitude> attitude;
  std::optional<GeoPosition> position;
  std::optional<double> altitude_m;
  bool altitude_is_above_ellipsoid = false;  // else above the geoid
  double sigma_altitude_m = 0.0;             // 0: not given
  std::optional<GeoVelocity> velocity;
  InsStatus status = InsStatus::kUnknown;
  // Depth that a pressure sensor gave to the INS, and its time since midnight.
  std::optional<InsVertical> sensor_depth;
  Duration sensor_depth_at{};
};

// Size of the frame at the beginning of the bytes: a FrameStream::SizeOf.
std::optional<std::size_t> SizeOfPhins(Bytes bytes);
// Decodes one whole frame. Absent where it has an unknown block, inconsistent sizes, or a value
// that is not a number. An answer of the INS ("AN") is an empty frame.
std::optional<PhinsFrame> DecodePhins(Bytes frame);

}  // namespace seastitch
