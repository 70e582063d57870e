#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "codecs/nmea0183.hpp"

// What pressure sensors write, one line a reading.
namespace seastitch {

struct DepthReading {
  enum class Kind : std::uint8_t {
    kDepthM,        // below the surface
    kPressureDbar,  // decibar
    kPressure,      // in the unit that the sensor is set to
  };
  Kind kind = Kind::kDepthM;
  double value = 0.0;
};

// Lines without NMEA's framing: Paroscientific Digiquartz ("*ddssVALUE": destination, source),
// Valeport ("VALUE,M" or "VALUE,dBar", a standard deviation behind it or not).
std::optional<DepthReading> DecodeDepthLine(std::string_view line);
// DBS, and Valeport's PIPS, PVIPS2 and PRVAT.
std::optional<DepthReading> DecodeDepthSentence(const NmeaSentence& sentence);

}  // namespace seastitch
