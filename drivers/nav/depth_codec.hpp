#pragma once

#include <cstdint>
#include <optional>

#include "codecs/navigation/depth_text.hpp"
#include "drivers/nav/nmea_codec.hpp"

namespace seastitch {

enum class PressureUnit : std::uint8_t {
  kPsi,
  kHectopascal,
  kBar,
  kDecibar,
  kKilopascal,
  kMegapascal,
  kInchOfMercury,
  kMillimetreOfMercury,
  kMetreOfWater,
};

struct DepthCodecParams {
  ClockParams clock;
  bool needs_checksum = true;
  double sigma_m = 0.05;
  PressureUnit unit = PressureUnit::kDecibar;  // for lines that do not state it
  double air_pressure_pa = 101'325.0;          // subtracted from the pressure; 0: gauge sensor
  double water_density_kgpm3 = 1025.0;
};

// Decodes a pressure sensor's lines (codecs/navigation/depth_text.hpp) to depths, positive down.
class DepthCodec : public NmeaCodec {
 public:
  explicit DepthCodec(const DepthCodecParams& params);

  // Counters: those of NmeaCodec; sentence_incomplete; implausible (depth below -20 m
  // or above 12 km).

 private:
  bool Take(const NmeaSentence& sentence, Time recv) override;
  bool TakeLine(const std::string& line, Time recv) override;
  void Measure(const DepthReading& reading, Time recv);

  DepthCodecParams params_;
};

}  // namespace seastitch
