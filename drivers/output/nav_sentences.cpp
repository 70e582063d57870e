#include "drivers/output/nav_sentences.hpp"

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

struct Kind {
  double NavSentencesParams::*rate_hz;
  std::string (NmeaWriter::*encode)(const NmeaState& state) const;
  double most_bytes;
};

constexpr std::array<Kind, 7> kSentences{{
    {&NavSentencesParams::gga_hz, &NmeaWriter::Gga, 75.0},
    {&NavSentencesParams::rmc_hz, &NmeaWriter::Rmc, 80.0},
    {&NavSentencesParams::gst_hz, &NmeaWriter::Gst, 65.0},
    {&NavSentencesParams::hdt_hz, &NmeaWriter::Hdt, 20.0},
    {&NavSentencesParams::vtg_hz, &NmeaWriter::Vtg, 45.0},
    {&NavSentencesParams::dpt_hz, &NmeaWriter::Dpt, 30.0},
    {&NavSentencesParams::zda_hz, &NmeaWriter::Zda, 40.0},
}};

}  // namespace

double BytesPerSecondOf(const NavSentencesParams& params) {
  double bytes = 0.0;
  for (const Kind& kind : kSentences) bytes += params.*kind.rate_hz * kind.most_bytes;
  return bytes;
}

NavSentences::NavSentences(const NavSentencesParams& params, const MapFrame& map)
    : params_(params), map_(map), writer_(params.talker) {
  static_assert(kSentences.size() == kKinds);
}

NmeaState NavSentences::StateOf(const NavState& state, std::optional<double> altitude_m) {
  const Eigen::Vector3d p = state.T_map_vehicle.translation();
  const double sigma_m = std::sqrt(state.covariance(0, 0) + state.covariance(1, 1));
  NmeaState nmea;
  nmea.time = state.time;
  nmea.covariance_ned = state.covariance.topLeftCorner<3, 3>();
  nmea.depth_m = p.z();
  nmea.altitude_m = altitude_m;
  nmea.v_north_east_mps = state.v_map_mps.head<2>();
  nmea.heading_rad = RpyFromRotation(state.T_map_vehicle.rotation()).z();
  nmea.quality = sigma_m <= params_.fix_sigma_m ? FixQuality::kAutonomous : FixQuality::kEstimated;
  has_position_ = sigma_m <= params_.position_sigma_max_m;
  if (!has_position_) return nmea;
  const Datum point = map_.PointAt(p.head<2>(), p.z());
  nmea.position = GeoPoint{Deg2Rad(point.latitude_deg), Deg2Rad(point.longitude_deg)};
  return nmea;
}

std::string NavSentences::Add(const NavState& state, std::optional<double> altitude_m) {
  const NmeaState nmea = StateOf(state, altitude_m);
  const double time_s = ToSeconds(state.time.time_since_epoch());
  std::string lines;
  for (std::size_t i = 0; i < kKinds; ++i) {
    const double rate_hz = params_.*kSentences[i].rate_hz;
    const auto period = static_cast<std::int64_t>(std::floor(time_s * rate_hz));
    if (rate_hz == 0.0 || last_period_[i] == period) continue;
    last_period_[i] = period;
    lines += (writer_.*kSentences[i].encode)(nmea);
  }
  return lines;
}

}  // namespace seastitch
