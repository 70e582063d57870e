#pragma once

#include <cstdint>
#include <optional>

#include "codecs/depth_text.hpp"
#include "drivers/nav/nmea_stream.hpp"

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

// Decodes a pressure sensor's lines (codecs/depth_text.hpp) to depths, positive down.
class DepthCodec : public NavCodec {
 public:
  explicit DepthCodec(const DepthCodecParams& params);

  std::vector<NavOutput> Add(Bytes bytes, Time recv) override;
  std::int64_t heard() const override { return stream_.heard(); }
  std::string hears_instead() const override { return stream_.hears_instead(); }

  // Those of NmeaStream; sentence_incomplete; implausible (depth below -20 m or above 12 km).
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 private:
  bool Take(const NmeaSentence& sentence, Time recv);
  void Give(const DepthReading& reading, Time recv);

  DepthCodecParams params_;
  NmeaStream stream_;
  DayClock clock_;
  Counters counters_;
  std::vector<NavOutput> out_;
};

}  // namespace seastitch
