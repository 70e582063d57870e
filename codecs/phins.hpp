#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "codecs/nmea0183.hpp"
#include "common/core/bytes.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

// iXblue's standard binary protocol, versions 2 to 5, big-endian: what an INS of theirs (PHINS,
// ROVINS, ...) computed at one instant. Blocks that are not read are stepped over by their sizes.
namespace seastitch {

struct PhinsFrame {
  int version = 0;
  Duration valid_at{};           // since midnight, where the INS is synchronised to UTC
  std::uint32_t counter = 0;     // of frames
  std::optional<Time> midnight;  // of the day
  std::optional<Attitude> attitude;
  std::optional<InsPosition> position;
  std::optional<double> altitude_m;
  bool altitude_is_above_ellipsoid = false;  // else above the geoid
  double sigma_altitude_m = 0.0;             // 0: not given
  std::optional<InsVelocity> velocity;
  InsStatus status = InsStatus::kUnknown;
  // What a pressure sensor gave to the INS, and when, since midnight.
  std::optional<InsVertical> sensor_depth;
  Duration sensor_depth_at{};
};

// Size of the frame that the bytes begin with, as FrameStream::SizeOf.
std::optional<std::size_t> SizeOfPhins(Bytes bytes);
// Of one whole frame. Nothing where it holds a block that nobody knows, sizes do not agree, or a
// value is none. An answer of the INS ("AN") is an empty frame.
std::optional<PhinsFrame> DecodePhins(Bytes frame);

}  // namespace seastitch
