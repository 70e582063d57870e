#include "drivers/dvl/pd0.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::uint16_t kEnsembleId = 0x7F7F;
constexpr std::uint16_t kFixedLeaderId = 0x0000;
constexpr std::uint16_t kVariableLeaderId = 0x0080;
constexpr std::uint16_t kBottomTrackId = 0x0600;
constexpr std::size_t kHeaderBytes = 6;
constexpr std::size_t kChecksumBytes = 2;
constexpr std::size_t kFixedLeaderBytes = 59;
constexpr std::size_t kVariableLeaderBytes = 65;
constexpr std::size_t kBottomTrackBytes = 81;
constexpr std::size_t kMaxBlocks = 64;
constexpr int kRtcBaseYear = 2000;
constexpr double kFullCorrelation = 255.0;
constexpr std::int16_t kNoVelocity = std::numeric_limits<std::int16_t>::min();

enum CoordinateBits : std::uint8_t { kTiltsUsed = 1 << 2 };
constexpr int kAxesShift = 3;

std::uint16_t Sum(Bytes bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint16_t{0}, [](auto sum, auto byte) {
    return static_cast<std::uint16_t>(sum + byte);
  });
}

// The three blocks that are read. A block's size is stated nowhere; its fields must fit.
struct Blocks {
  Bytes fixed, variable, bottom;
};

std::optional<Blocks> ReadBlocks(Bytes ensemble) {
  ByteReader header(ensemble);
  header.Skip(5);
  const std::size_t num_blocks = header.Le<std::uint8_t>();
  if (num_blocks > kMaxBlocks) return std::nullopt;
  Blocks blocks;
  for (std::size_t i = 0; i < num_blocks; ++i) {
    ByteReader block(ensemble);
    block.Skip(header.Le<std::uint16_t>());
    const Bytes from_here = block.ok() ? ensemble.subspan(block.at()) : Bytes();
    const auto id = block.Le<std::uint16_t>();
    if (!header.ok() || !block.ok()) return std::nullopt;
    if (id == kFixedLeaderId) blocks.fixed = from_here;
    if (id == kVariableLeaderId) blocks.variable = from_here;
    if (id == kBottomTrackId) blocks.bottom = from_here;
  }
  return blocks;
}

// Time from year of the century, month, day, hour, minute, second, hundredths.
std::optional<Time> ReadTime(ByteReader* in) {
  std::array<unsigned, 7> rtc;
  for (unsigned& field : rtc) field = in->Le<std::uint8_t>();
  const std::chrono::year_month_day date{std::chrono::year(kRtcBaseYear + static_cast<int>(rtc[0])),
                                         std::chrono::month(rtc[1]),
                                         std::chrono::day(rtc[2])};
  if (!date.ok() || rtc[3] > 23 || rtc[4] > 59 || rtc[5] > 59 || rtc[6] > 99) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch();
  return Time(std::chrono::duration_cast<Duration>(days) + std::chrono::hours(rtc[3]) +
              std::chrono::minutes(rtc[4]) + std::chrono::seconds(rtc[5]) +
              std::chrono::milliseconds(10 * rtc[6]));
}

void WriteTime(Time time, ByteWriter* out) {
  const std::chrono::sys_time<Duration> instant(time.time_since_epoch());
  const auto day = std::chrono::floor<std::chrono::days>(instant);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(instant - day);
  for (const auto field : {static_cast<std::int64_t>(static_cast<int>(date.year()) - kRtcBaseYear),
                           static_cast<std::int64_t>(static_cast<unsigned>(date.month())),
                           static_cast<std::int64_t>(static_cast<unsigned>(date.day())),
                           static_cast<std::int64_t>(clock.hours().count()),
                           static_cast<std::int64_t>(clock.minutes().count()),
                           static_cast<std::int64_t>(clock.seconds().count()),
                           static_cast<std::int64_t>(clock.subseconds().count() / 10'000)})
    out->Le(static_cast<std::uint8_t>(field));
}

double Hundredths(double degrees_100) { return Deg2Rad(degrees_100 / 100.0); }

std::int16_t ToHundredths(double rad) {
  return static_cast<std::int16_t>(std::lround(Rad2Deg(rad) * 100.0));
}

bool ReadVariableLeader(Bytes block, Pd0Ensemble* out) {
  ByteReader in(block);
  in.Skip(2);
  out->number = in.Le<std::uint16_t>();
  const std::optional<Time> time = ReadTime(&in);
  in.Skip(7);
  out->heading_rad = Hundredths(in.Le<std::uint16_t>());
  out->pitch_rad = Hundredths(in.Le<std::int16_t>());
  out->roll_rad = Hundredths(in.Le<std::int16_t>());
  if (!in.ok() || !time) return false;
  out->time = *time;
  return true;
}

bool ReadBottomTrack(Bytes block, Pd0Ensemble* out) {
  ByteReader in(block);
  in.Skip(16);
  std::array<std::uint32_t, 4> range_cm;
  for (std::uint32_t& range : range_cm) range = in.Le<std::uint16_t>();
  for (auto& velocity : out->velocity_mps) {
    const auto raw_mmps = in.Le<std::int16_t>();
    if (raw_mmps != kNoVelocity) velocity = raw_mmps / 1000.0;
  }
  std::array<std::uint8_t, 4> correlation;
  for (std::uint8_t& beam : correlation) beam = in.Le<std::uint8_t>();
  // A DVL without correlation sends zeros; four real beams are never all zero.
  if (correlation != std::array<std::uint8_t, 4>{}) out->correlation = correlation;
  in.Skip(41);
  for (std::size_t beam = 0; beam < 4; ++beam) {
    range_cm[beam] += std::uint32_t{in.Le<std::uint8_t>()} << 16;
    if (range_cm[beam] > 0) out->range_m[beam] = range_cm[beam] / 100.0;
  }
  return in.ok();
}

// Velocity of the bottom (starboard, forward, up) from the four beams' velocities, each positive
// towards the DVL. Beams 1 and 2 point to port and starboard, 3 and 4 forward and aft.
Eigen::Vector3d FromBeams(const std::array<double, 4>& v, double beam_angle_rad) {
  const double across = 1.0 / (2.0 * std::sin(beam_angle_rad));
  const double along = 1.0 / (4.0 * std::cos(beam_angle_rad));
  return {across * (v[0] - v[1]), across * (v[3] - v[2]), along * (v[0] + v[1] + v[2] + v[3])};
}

// Error velocity as the device computes it in all other axes: the difference of the two vertical
// velocities that the pairs of beams give, scaled to the noise of a horizontal velocity.
double ErrorVelocity(const std::array<double, 4>& v, double beam_angle_rad) {
  return (v[0] + v[1] - v[2] - v[3]) / (std::sqrt(8.0) * std::sin(beam_angle_rad));
}

// Rotation from the DVL's axes to the axes of its velocities.
Eigen::Matrix3d RotationToItsAxes(const Pd0Ensemble& e) {
  const bool earth = e.axes == Pd0Ensemble::Axes::kEarth;
  if (!e.levelled && !earth) return Eigen::Matrix3d::Identity();
  // The DVL's pitch is the reading of a tilt sensor that rolls with it. Converts it to the pitch
  // angle of roll, pitch, yaw.
  const double pitch_rad = std::atan(std::tan(e.pitch_rad) * std::cos(e.roll_rad));
  return RotationFromRpy(e.roll_rad, pitch_rad, earth ? e.heading_rad : 0.0);
}

bool HasVelocity(const Pd0Ensemble& e) {
  const bool beams = e.axes == Pd0Ensemble::Axes::kBeam;
  return std::all_of(e.velocity_mps.begin(),
                     e.velocity_mps.begin() + (beams ? 4 : 3),
                     [](const std::optional<double>& v) { return v.has_value(); });
}

}  // namespace

std::optional<Pd0Ensemble> DecodePd0(Bytes bytes, std::size_t* size) {
  ByteReader in(bytes);
  const auto id = in.Le<std::uint16_t>();
  const std::size_t checksum_at = in.Le<std::uint16_t>();
  if (!in.ok() || id != kEnsembleId || checksum_at < kHeaderBytes ||
      checksum_at + kChecksumBytes > bytes.size())
    return std::nullopt;
  const Bytes ensemble = bytes.first(checksum_at);
  if (ByteReader(bytes.subspan(checksum_at)).Le<std::uint16_t>() != Sum(ensemble))
    return std::nullopt;
  const std::optional<Blocks> blocks = ReadBlocks(ensemble);
  if (!blocks) return std::nullopt;

  Pd0Ensemble out;
  ByteReader fixed(blocks->fixed);
  fixed.Skip(25);
  const auto coordinates = fixed.Le<std::uint8_t>();
  out.axes = static_cast<Pd0Ensemble::Axes>((coordinates >> kAxesShift) & 3);
  out.levelled = (coordinates & kTiltsUsed) != 0;
  if (!fixed.ok() || !ReadVariableLeader(blocks->variable, &out) ||
      !ReadBottomTrack(blocks->bottom, &out))
    return std::nullopt;
  *size = checksum_at + kChecksumBytes;
  return out;
}

std::vector<std::uint8_t> EncodePd0(const Pd0Ensemble& e) {
  const std::size_t fixed_at = kHeaderBytes + 3 * 2;
  const std::size_t variable_at = fixed_at + kFixedLeaderBytes;
  const std::size_t bottom_at = variable_at + kVariableLeaderBytes;
  const std::size_t checksum_at = bottom_at + kBottomTrackBytes;
  ByteWriter out;
  out.Le(kEnsembleId);
  out.Le(static_cast<std::uint16_t>(checksum_at));
  out.Zeros(1);
  out.Le(std::uint8_t{3});
  for (const std::size_t at : {fixed_at, variable_at, bottom_at})
    out.Le(static_cast<std::uint16_t>(at));

  out.Le(kFixedLeaderId);
  out.Zeros(23);
  out.Le(static_cast<std::uint8_t>(static_cast<int>(e.axes) << kAxesShift |
                                   (e.levelled ? kTiltsUsed : 0)));
  out.Zeros(variable_at - out.size());

  out.Le(kVariableLeaderId);
  out.Le(e.number);
  WriteTime(e.time, &out);
  out.Zeros(7);
  out.Le(static_cast<std::uint16_t>(std::lround(Rad2Deg(e.heading_rad) * 100.0)));
  out.Le(ToHundredths(e.pitch_rad));
  out.Le(ToHundredths(e.roll_rad));
  out.Zeros(bottom_at - out.size());

  out.Le(kBottomTrackId);
  out.Zeros(14);
  std::array<std::uint32_t, 4> range_cm;
  for (std::size_t beam = 0; beam < 4; ++beam)
    range_cm[beam] = static_cast<std::uint32_t>(std::lround(e.range_m[beam].value_or(0.0) * 100.0));
  for (const std::uint32_t range : range_cm) out.Le(static_cast<std::uint16_t>(range));
  for (const std::optional<double>& velocity : e.velocity_mps)
    out.Le(velocity ? static_cast<std::int16_t>(std::lround(*velocity * 1000.0)) : kNoVelocity);
  for (std::size_t beam = 0; beam < 4; ++beam)
    out.Le(e.correlation ? (*e.correlation)[beam] : std::uint8_t{0});
  out.Zeros(41);
  for (const std::uint32_t range : range_cm) out.Le(static_cast<std::uint8_t>(range >> 16));
  out.Le(Sum(out.bytes()));
  return out.Release();
}

DvlSample ToDvlSample(const Pd0Ensemble& e, const Pd0Params& params) {
  DvlSample sample;
  sample.bottom_lock = HasVelocity(e);
  if (sample.bottom_lock) {
    sample.error_velocity_mps = e.velocity_mps[3];
    Eigen::Vector3d v_bottom(*e.velocity_mps[0], *e.velocity_mps[1], *e.velocity_mps[2]);
    if (e.axes == Pd0Ensemble::Axes::kBeam) {
      std::array<double, 4> along;
      for (std::size_t beam = 0; beam < 4; ++beam)
        sample.beams[beam].velocity_mps = along[beam] = *e.velocity_mps[beam];
      v_bottom = FromBeams(along, params.beam_angle_rad);
      sample.error_velocity_mps = ErrorVelocity(along, params.beam_angle_rad);
    }
    // The DVL moves against the bottom: opposite sign. Starboard, forward, up become forward,
    // starboard, down.
    const Eigen::Vector3d v_its_axes(-v_bottom.y(), -v_bottom.x(), v_bottom.z());
    sample.v_dvl_mps = RotationToItsAxes(e).transpose() * v_its_axes;
    sample.sigma_v_mps.setConstant(params.sigma_mps);
  }
  double sum_m = 0.0;
  int num_ranges = 0;
  for (std::size_t beam = 0; beam < 4; ++beam) {
    sample.beams[beam].valid = e.range_m[beam].has_value();
    if (e.correlation) sample.beams[beam].quality = (*e.correlation)[beam] / kFullCorrelation;
    if (!e.range_m[beam]) {
      sample.beams[beam].velocity_mps = 0.0;
      continue;
    }
    sample.beams[beam].range_m = *e.range_m[beam] / std::cos(params.beam_angle_rad);
    sum_m += *e.range_m[beam];
    ++num_ranges;
  }
  // In the mean of four beams, the slope of the bottom and the tilt of the DVL cancel to first
  // order.
  if (num_ranges == 4)
    sample.altitude_m = sum_m / 4.0 * std::cos(e.pitch_rad) * std::cos(e.roll_rad);
  return sample;
}

Pd0Ensemble ToPd0Ensemble(const DvlSample& sample, const Pd0Params& params) {
  Pd0Ensemble e;
  e.time = sample.time;
  if (sample.bottom_lock) {
    const Eigen::Vector3d& v = sample.v_dvl_mps;
    e.velocity_mps = {-v.y(), -v.x(), v.z(), sample.error_velocity_mps};
  }
  if (HasQuality(sample)) {
    std::array<std::uint8_t, 4>& correlation = e.correlation.emplace();
    for (std::size_t beam = 0; beam < 4; ++beam)
      correlation[beam] =
          static_cast<std::uint8_t>(std::lround(*sample.beams[beam].quality * kFullCorrelation));
  }
  for (std::size_t beam = 0; beam < 4; ++beam)
    if (sample.beams[beam].valid)
      e.range_m[beam] = sample.beams[beam].range_m * std::cos(params.beam_angle_rad);
  return e;
}

std::vector<DvlSample> Pd0Decoder::Add(Bytes datagram, Time recv) {
  std::vector<DvlSample> samples;
  std::size_t size = 0;
  for (Bytes left = datagram; !left.empty() || datagram.empty(); left = left.subspan(size)) {
    const std::optional<Pd0Ensemble> ensemble = DecodePd0(left, &size);
    if (!ensemble) {
      ++counters_["pd0_malformed"];
      break;
    }
    if (IsRepeat(*ensemble)) continue;
    DvlSample sample = ToDvlSample(*ensemble, params_);
    const std::optional<Time> time = stamper_.Stamp(ensemble->time, recv);
    if (!time) {
      ++counters_["pd0_unstamped"];
      continue;
    }
    sample.time = *time;
    samples.push_back(sample);
  }
  return samples;
}

bool Pd0Decoder::IsRepeat(const Pd0Ensemble& ensemble) {
  const bool repeat = last_ && last_->number == ensemble.number && last_->time == ensemble.time;
  if (repeat) {
    ++counters_["pd0_repeated"];
    return true;
  }
  if (last_) {
    const auto step = static_cast<std::uint16_t>(ensemble.number - last_->number);
    // A larger step means that the DVL was restarted, or that an ensemble came late.
    if (step > 1 && step < 1000) counters_["pd0_gaps"] += step - 1;
  }
  last_ = ensemble;
  return false;
}

}  // namespace seastitch
