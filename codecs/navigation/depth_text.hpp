#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "codecs/navigation/nmea0183.hpp"

// Text lines of pressure sensors, one line per reading.
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

// Decodes lines without NMEA's framing: Paroscientific Digiquartz ("*ddssVALUE": destination,
// source), Valeport ("VALUE,M" or "VALUE,dBar", with or without a standard deviation after it).
std::optional<DepthReading> DecodeDepthLine(std::string_view line);
// Decodes the NMEA sentences DBS, PIPS, PVIPS2 and PRVAT (the last three by Valeport).
std::optional<DepthReading> DecodeDepthSentence(const NmeaSentence& sentence);

}  // namespace seastitch
