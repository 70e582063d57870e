#include "codecs/kongsberg/kmall_sensors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "codecs/navigation/nmea0183.hpp"
#include "codecs/sound_profile.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxProfileSamples = 2000;
constexpr std::size_t kMaxMotionSamples = 148;
constexpr std::size_t kSvpInfoBytes = 28;
constexpr std::size_t kSkmInfoBytes = 12;
constexpr std::size_t kSvtInfoBytes = 20;
constexpr std::size_t kKmbBytes = 120;
constexpr std::uint8_t kKmBinaryBytes = 132;  // of the binary KMB with the delayed heave
constexpr float kNoHeight_m = -999.0f;

// Samples of equal size after an info part that states, at byte `at`, their number and size (both
// u16).
struct SampleArray {
  std::size_t count = 0;
  std::size_t bytes_each = 0;
  Bytes bytes;
};

std::optional<SampleArray> ReadSamples(Bytes datagram,
                                       std::string_view type,
                                       std::size_t least_info_bytes,
                                       std::size_t at,
                                       std::size_t most,
                                       std::size_t least_bytes_each) {
  const std::optional<Bytes> body = WholeKmall(datagram, type);
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kKmallHeaderBytes);
  ByteReader info(TakeSizedKmall(&in, *body, least_info_bytes));
  info.Skip(at);
  SampleArray samples;
  samples.count = info.Le<std::uint16_t>();
  samples.bytes_each = info.Le<std::uint16_t>();
  samples.bytes = in.Take(samples.count * samples.bytes_each);
  const bool usable =
      in.ok() && info.ok() && samples.count <= most && samples.bytes_each >= least_bytes_each;
  return usable ? std::optional(samples) : std::nullopt;
}

// Status bits of a #KMB: the values that are invalid.
enum KmbInvalid : std::uint32_t {
  kPositionInvalid = 1,
  kRollPitchInvalid = 2,
  kHeadingInvalid = 4,
  kHeaveInvalid = 8,
  kSigmasInvalid = 32,
};

// Sigma of one sample, from its field; 0 if the sensor does not state it.
double SigmaOr0(float sigma, bool given) {
  return given && std::isfinite(sigma) && sigma > 0.0f ? double{sigma} : 0.0;
}

bool IsPosition(double latitude_deg, double longitude_deg) {
  return std::abs(latitude_deg) <= 90.0 && std::abs(longitude_deg) <= 180.0;
}

struct Kmb {
  double latitude_deg, longitude_deg;
  float height_m, roll_deg, pitch_deg, heading_deg, heave_m;
  Eigen::Vector3f v_ned_mps;
  // latitude, longitude, height, roll, pitch, heading, heave
  std::array<float, 7> sigmas;
};

void Fill(const Kmb& kmb, NavigationRecord* sample) {
  const auto valid = [sample](std::uint32_t bit) { return (sample->status & bit) == 0; };
  const auto sigma = [&](std::size_t i) { return SigmaOr0(kmb.sigmas[i], valid(kSigmasInvalid)); };
  if (valid(kPositionInvalid) && IsPosition(kmb.latitude_deg, kmb.longitude_deg)) {
    sample->position =
        GeoPosition{Deg2Rad(kmb.latitude_deg), Deg2Rad(kmb.longitude_deg), {sigma(0), sigma(1)}};
    if (std::isfinite(kmb.height_m) && kmb.height_m != kNoHeight_m) sample->height_m = kmb.height_m;
    if (kmb.v_ned_mps.allFinite()) sample->velocity = GeoVelocity{kmb.v_ned_mps.cast<double>()};
  }
  if (valid(kRollPitchInvalid | kHeadingInvalid) && std::isfinite(kmb.roll_deg) &&
      std::isfinite(kmb.pitch_deg) && std::isfinite(kmb.heading_deg)) {
    sample->attitude = AttitudeFromDegrees(kmb.roll_deg, kmb.pitch_deg, kmb.heading_deg);
    sample->attitude->sigma_rpy_rad = Eigen::Vector3d(sigma(3), sigma(4), sigma(5)) * Deg2Rad(1.0);
  }
  if (valid(kHeaveInvalid) && std::isfinite(kmb.heave_m)) sample->heave_m = kmb.heave_m;
}

NavigationRecord ReadKmb(Bytes bytes, const std::string& source) {
  ByteReader in(bytes);
  in.Skip(8);
  NavigationRecord sample;
  sample.source = source;
  sample.time = ReadKmallTime(&in);
  sample.status = in.Le<std::uint32_t>();
  Kmb kmb;
  kmb.latitude_deg = in.Le<double>();
  kmb.longitude_deg = in.Le<double>();
  for (float* const field :
       {&kmb.height_m, &kmb.roll_deg, &kmb.pitch_deg, &kmb.heading_deg, &kmb.heave_m})
    *field = in.Le<float>();
  in.Skip(12);  // rates
  for (float& v : kmb.v_ned_mps) v = in.Le<float>();
  for (float& sigma : kmb.sigmas) sigma = in.Le<float>();
  Fill(kmb, &sample);
  return sample;
}

void WriteKmallTime(Time time, ByteWriter* out) {
  const std::int64_t utime = ToUtime(time);
  out->Le(static_cast<std::uint32_t>(utime / 1'000'000));
  out->Le(static_cast<std::uint32_t>(utime % 1'000'000 * 1000));
}

void WriteKmb(const NavigationRecord& sample, ByteWriter* out) {
  const auto invalid = [](bool given, KmbInvalid bit) {
    return given ? 0u : static_cast<std::uint32_t>(bit);
  };
  const auto number = [out](double value) { out->Le(static_cast<float>(value)); };
  for (const char c : {'#', 'K', 'M', 'B'}) out->Le(static_cast<std::uint8_t>(c));
  out->Le(static_cast<std::uint16_t>(kKmbBytes));
  out->Le(std::uint16_t{1});
  WriteKmallTime(sample.time, out);
  out->Le(invalid(sample.position.has_value(), kPositionInvalid) |
          invalid(sample.attitude.has_value(), kRollPitchInvalid) |
          invalid(sample.attitude.has_value(), kHeadingInvalid) |
          invalid(sample.heave_m.has_value(), kHeaveInvalid));
  const GeoPosition position = sample.position.value_or(GeoPosition{});
  out->Le(Rad2Deg(position.latitude_rad));
  out->Le(Rad2Deg(position.longitude_rad));
  out->Le(sample.height_m ? static_cast<float>(*sample.height_m) : kNoHeight_m);
  const Attitude attitude = sample.attitude.value_or(Attitude{});
  const Eigen::Vector3d rpy_deg =
      RpyFromRotation(attitude.q_ned_imu.toRotationMatrix()) * (180.0 / kPi);
  for (const double angle :
       {rpy_deg.x(), rpy_deg.y(), rpy_deg.z() < 0.0 ? rpy_deg.z() + 360.0 : rpy_deg.z()})
    number(angle);
  number(sample.heave_m.value_or(0.0));
  out->Zeros(12);  // rates
  const GeoVelocity velocity = sample.velocity.value_or(GeoVelocity{});
  for (const double v : velocity.v_ned_mps) number(v);
  const Eigen::Vector3d sigma_deg = attitude.sigma_rpy_rad * (180.0 / kPi);
  for (const double sigma : {position.sigma_north_east_m.x(),
                             position.sigma_north_east_m.y(),
                             0.0,
                             sigma_deg.x(),
                             sigma_deg.y(),
                             sigma_deg.z(),
                             0.0})
    number(sigma);
  out->Zeros(kKmbBytes - 108);  // accelerations
}

}  // namespace

std::optional<SoundVelocityProfile> DecodeSvp(Bytes datagram) {
  const std::optional<Bytes> body = WholeKmall(datagram, "#SVP");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kKmallHeaderBytes);
  const Bytes info_bytes = TakeSizedKmall(&in, *body, kSvpInfoBytes);
  if (!in.ok()) return std::nullopt;
  ByteReader info(info_bytes);
  info.Skip(2);
  const std::size_t num_samples = info.Le<std::uint16_t>();
  info.Skip(4);
  const auto cast_time_s = info.Le<std::uint32_t>();
  // Files of real sonars have stray text after the samples.
  if (num_samples > kMaxProfileSamples || in.left() < num_samples * 20) return std::nullopt;

  // A cast stamped in a ship's local time can lie ahead of the sonar's clock; the profile is in use
  // from this datagram on.
  const Time now = ReadKmallHeader(datagram)->time();
  const Time time =
      cast_time_s == 0 ? now : std::min(now, FromUtime(std::int64_t{cast_time_s} * 1'000'000));
  std::vector<ProfileRow> rows(num_samples);
  for (ProfileRow& row : rows) {
    row.depth_m = in.Le<float>();
    row.speed_mps = in.Le<float>();
    in.Skip(12);
  }
  return ProfileFrom(time, std::move(rows));
}

std::vector<std::uint8_t> EncodeSvp(const SoundVelocityProfile& profile,
                                    const KmallHeader& header) {
  const std::size_t num_samples = std::min(profile.depth_m.size(), profile.speed_mps.size());
  if (num_samples > kMaxProfileSamples) throw std::invalid_argument("#SVP: more than 2000 samples");
  KmallHeader svp = header;
  svp.type = {'#', 'S', 'V', 'P'};
  svp.version = 1;
  ByteWriter out;
  WriteKmallHeader(svp, profile.time, &out);
  out.Le(static_cast<std::uint16_t>(kSvpInfoBytes));
  out.Le(static_cast<std::uint16_t>(num_samples));
  for (const char c : {'S', '0', '0', '\0'}) out.Le(static_cast<std::uint8_t>(c));
  out.Le(static_cast<std::uint32_t>(ToUtime(profile.time) / 1'000'000));
  out.Le(200.0);  // latitude and longitude: unknown
  out.Le(200.0);
  for (std::size_t i = 0; i < num_samples; ++i) {
    out.Le(static_cast<float>(profile.depth_m[i]));
    out.Le(static_cast<float>(profile.speed_mps[i]));
    out.Zeros(12);
  }
  return SealKmall(&out);
}

std::optional<NavigationRecord> DecodeSpo(Bytes datagram) {
  constexpr std::uint16_t kInvalid = 1 << 4;
  constexpr std::uint16_t kTimeFromSensor = 1 << 9;
  const std::optional<Bytes> body = WholeKmall(datagram, "#SPO");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kKmallHeaderBytes);
  ByteReader common(TakeSizedKmall(&in, *body, 8));
  common.Skip(2);
  const int system = common.Le<std::uint16_t>();
  NavigationRecord sample;
  sample.source = "#SPO" + std::to_string(system);
  sample.status = common.Le<std::uint16_t>();
  const Time sensor_time = ReadKmallTime(&in);
  sample.time = ReadKmallHeader(datagram)->time();
  if ((sample.status & kTimeFromSensor) != 0)
    sample.arrival = std::exchange(sample.time, sensor_time);
  const float quality_m = in.Le<float>();
  const double latitude_deg = in.Le<double>();
  const double longitude_deg = in.Le<double>();
  const float speed_mps = in.Le<float>();
  const float course_deg = in.Le<float>();
  const float height_m = in.Le<float>();
  if (!in.ok()) return std::nullopt;
  if ((sample.status & kInvalid) != 0) return sample;
  if (!IsPosition(latitude_deg, longitude_deg)) return std::nullopt;
  constexpr float kNoQuality = 65535.0f;
  const double sigma_m = SigmaOr0(quality_m, quality_m < kNoQuality);
  sample.position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg), {sigma_m, sigma_m}};
  if (std::isfinite(height_m) && height_m != kNoHeight_m) sample.height_m = height_m;
  // Negative values (-1 and -4, by the manual) mean "unavailable".
  if (speed_mps >= 0.0f && speed_mps < 100.0f && course_deg >= 0.0f && course_deg <= 360.0f) {
    const double course_rad = Deg2Rad(double{course_deg});
    sample.velocity = GeoVelocity{double{speed_mps} *
                                  Eigen::Vector3d(std::cos(course_rad), std::sin(course_rad), 0.0)};
  }
  return sample;
}

std::optional<std::vector<NavigationRecord>> DecodeSkm(Bytes datagram) {
  const std::optional<SampleArray> samples =
      ReadSamples(datagram, "#SKM", kSkmInfoBytes, 6, kMaxMotionSamples, 120);
  if (!samples) return std::nullopt;
  const std::string source = "#SKM" + std::to_string(int{datagram[22]});
  std::vector<NavigationRecord> motion;
  for (std::size_t i = 0; i < samples->count; ++i)
    motion.push_back(ReadKmb(samples->bytes.subspan(i * samples->bytes_each), source));
  return motion;
}

std::optional<std::size_t> SizeOfKmBinary(Bytes bytes) {
  constexpr std::array<std::uint8_t, 8> kBegin{'#', 'K', 'M', 'B', kKmBinaryBytes, 0, 1, 0};
  const std::size_t known = std::min(bytes.size(), kBegin.size());
  if (!std::equal(
          bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(known), kBegin.begin()))
    return std::nullopt;
  return bytes.size() < kKmBinaryBytes ? 0 : kKmBinaryBytes;
}

std::optional<NavigationRecord> DecodeKmBinary(Bytes datagram) {
  if (datagram.size() != kKmBinaryBytes || SizeOfKmBinary(datagram) != kKmBinaryBytes)
    return std::nullopt;
  return ReadKmb(datagram, "kmb");
}

std::optional<std::size_t> SizeOfKmMotion(Bytes bytes) {
  constexpr std::size_t kMostSkmBytes = 20'000;  // of 148 samples
  if (const auto size = SizeOfKmBinary(bytes)) return size;
  if (bytes.size() < 8) return 0;
  const std::size_t size = ByteReader(bytes).Le<std::uint32_t>();
  const std::string type(bytes.begin() + 4, bytes.begin() + 8);
  if (type != "#SKM" || size < kKmallHeaderBytes + kKmallTailBytes || size > kMostSkmBytes)
    return std::nullopt;
  if (bytes.size() < size) return 0;
  return WholeKmall(bytes.first(size), "#SKM") ? std::optional(size) : std::nullopt;
}

std::optional<std::vector<NavigationRecord>> DecodeKmMotion(Bytes datagram) {
  if (const auto one = DecodeKmBinary(datagram)) return std::vector{*one};
  return DecodeSkm(datagram);
}

std::vector<std::uint8_t> EncodeSpo(const NavigationRecord& sample, const KmallHeader& header) {
  constexpr std::uint16_t kActiveByItsOwnTime = 1 | 1 << 9;
  KmallHeader spo = header;
  spo.type = {'#', 'S', 'P', 'O'};
  spo.version = 0;
  ByteWriter out;
  WriteKmallHeader(spo, sample.time, &out);
  out.Le(std::uint16_t{8});
  out.Le(std::uint16_t{0});  // system
  out.Le(kActiveByItsOwnTime);
  out.Zeros(2);
  WriteKmallTime(sample.time, &out);
  out.Le(static_cast<float>(sample.position->sigma_north_east_m.maxCoeff()));
  out.Le(Rad2Deg(sample.position->latitude_rad));
  out.Le(Rad2Deg(sample.position->longitude_rad));
  const Eigen::Vector3d v = sample.velocity.value_or(GeoVelocity{}).v_ned_mps;
  const double course_rad = std::atan2(v.y(), v.x());
  out.Le(sample.velocity ? static_cast<float>(v.head<2>().norm()) : -1.0f);
  out.Le(sample.velocity
             ? static_cast<float>(Rad2Deg(course_rad < 0.0 ? course_rad + 2.0 * kPi : course_rad))
             : -4.0f);
  out.Le(sample.height_m ? static_cast<float>(*sample.height_m) : kNoHeight_m);
  return SealKmall(&out);
}

std::vector<std::uint8_t> EncodeSkm(const std::vector<NavigationRecord>& samples,
                                    const KmallHeader& header) {
  if (samples.empty() || samples.size() > kMaxMotionSamples)
    throw std::invalid_argument("#SKM: 1 to 148 samples");
  KmallHeader skm = header;
  skm.type = {'#', 'S', 'K', 'M'};
  skm.version = 1;
  ByteWriter out;
  WriteKmallHeader(skm, samples[0].time, &out);
  out.Le(static_cast<std::uint16_t>(kSkmInfoBytes));
  out.Zeros(4);  // system 0
  out.Le(static_cast<std::uint16_t>(samples.size()));
  out.Le(static_cast<std::uint16_t>(kKmbBytes));
  out.Zeros(kSkmInfoBytes - 10);
  for (const NavigationRecord& sample : samples) WriteKmb(sample, &out);
  return SealKmall(&out);
}

std::optional<std::vector<SurfaceSoundSpeed>> DecodeSvt(Bytes datagram) {
  const std::optional<SampleArray> samples =
      ReadSamples(datagram, "#SVT", kSvtInfoBytes, 6, kMaxMotionSamples, 24);
  if (!samples) return std::nullopt;
  std::vector<SurfaceSoundSpeed> speeds;
  for (std::size_t i = 0; i < samples->count; ++i) {
    ByteReader in(samples->bytes.subspan(i * samples->bytes_each));
    const Time time = ReadKmallTime(&in);
    const double speed_mps = in.Le<float>();
    if (!std::isfinite(speed_mps) || speed_mps <= 0.0) return std::nullopt;
    speeds.push_back({time, speed_mps});
  }
  return speeds;
}

std::optional<ClockComparison> DecodeScl(Bytes datagram) {
  const std::optional<Bytes> body = WholeKmall(datagram, "#SCL");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kKmallHeaderBytes);
  ByteReader common(TakeSizedKmall(&in, *body, 8));
  common.Skip(2);
  ClockComparison clock;
  clock.source = "#SCL" + std::to_string(common.Le<std::uint16_t>());
  clock.time = ReadKmallHeader(datagram)->time();
  in.Skip(8);  // offset, and deviation from the PPS
  if (!in.ok() || !common.ok()) return std::nullopt;
  std::string text = TextFromBytes(in.Take(in.left()));
  text.resize(std::min(text.size(), text.find_first_of(std::string_view("\r\n\0", 3))));
  Counters unused;
  const std::optional<NmeaSentence> sentence = ParseNmea(text, false, &unused);
  if (!sentence || sentence->type != "ZDA") return std::nullopt;
  const std::optional<Time> external = DecodeZda(*sentence);
  if (!external) return std::nullopt;
  clock.external_time = *external;
  return clock;
}

}  // namespace seastitch
