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
    : params_(params), stream_(params.needs_checksum), clock_(params.clock) {}

std::vector<NavOutput> DepthCodec::Add(Bytes bytes, Time recv) {
  stream_.Add(
      bytes,
      recv,
      [this](const NmeaSentence& s, Time begun) { return Take(s, begun); },
      [this](const std::string& line, Time begun) {
        const auto reading = DecodeDepthLine(line);
        if (reading) Give(*reading, begun);
        return reading.has_value();
      });
  return std::exchange(out_, {});
}

Counters DepthCodec::counters() const {
  Counters all = stream_.counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

bool DepthCodec::Take(const NmeaSentence& s, Time recv) {
  if (s.type != "DBS" && s.type != "PIPS" && s.type != "PVIPS2" && s.type != "PRVAT") return false;
  if (const auto reading = DecodeDepthSentence(s))
    Give(*reading, recv);
  else
    ++counters_["sentence_incomplete"];
  return true;
}

void DepthCodec::Give(const DepthReading& reading, Time recv) {
  DepthSample sample;
  sample.time = *clock_.Stamp(std::nullopt, recv);
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
    ++counters_["implausible"];
    return;
  }
  out_.emplace_back(sample);
}

}  // namespace seastitch
