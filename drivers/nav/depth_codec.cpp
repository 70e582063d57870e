#include "drivers/nav/depth_codec.hpp"

#include <utility>

namespace seastitch {
namespace {

constexpr double kGravity_mps2 = 9.80665;
constexpr double kPascalPerDecibar = 1e4;

double PascalPer(PressureUnit unit) {
  switch (unit) {
    case PressureUnit::kPsi: return 6894.757;
    case PressureUnit::kHectopascal: return 100.0;
    case PressureUnit::kBar: return 1e5;
    case PressureUnit::kDecibar: return kPascalPerDecibar;
    case PressureUnit::kKilopascal: return 1e3;
    case PressureUnit::kMegapascal: return 1e6;
    case PressureUnit::kInchOfMercury: return 3386.389;
    case PressureUnit::kMillimetreOfMercury: return 133.3224;
    case PressureUnit::kMetreOfWater: return 9806.65;
  }
  return kPascalPerDecibar;
}

}  // namespace

DepthCodec::DepthCodec(const DepthCodecParams& params)
    : NmeaCodec(params.needs_checksum, params.clock), params_(params) {}

bool DepthCodec::TakeLine(const std::string& line, Time recv) {
  const auto reading = DecodeDepthLine(line);
  if (reading) Measure(*reading, recv);
  return reading.has_value();
}

bool DepthCodec::Take(const NmeaSentence& s, Time recv) {
  if (s.type != "DBS" && s.type != "PIPS" && s.type != "PVIPS2" && s.type != "PRVAT") return false;
  if (const auto reading = DecodeDepthSentence(s))
    Measure(*reading, recv);
  else
    Count("sentence_incomplete");
  return true;
}

void DepthCodec::Measure(const DepthReading& reading, Time recv) {
  DepthSample sample;
  sample.time = *Stamp(std::nullopt, recv);
  sample.sigma_m = params_.sigma_m;
  if (reading.kind == DepthReading::Kind::kDepthM) {
    sample.depth_m = reading.value;
  } else {
    const double pascal = reading.kind == DepthReading::Kind::kPressureDbar
                              ? kPascalPerDecibar
                              : PascalPer(params_.unit);
    sample.pressure_pa = reading.value * pascal - params_.air_pressure_pa;
    sample.depth_m = *sample.pressure_pa / (params_.water_density_kgpm3 * kGravity_mps2);
  }
  if (!(sample.depth_m > -20.0 && sample.depth_m < 12'000.0)) {
    Count("implausible");
    return;
  }
  Emit(sample);
}

}  // namespace seastitch
