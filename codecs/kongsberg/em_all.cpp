#include "codecs/kongsberg/em_all.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/kongsberg/receiver_roll.hpp"
#include "codecs/mbes_codec.hpp"
#include "codecs/navigation/nmea0183.hpp"
#include "codecs/sound_profile.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kHeaderBytes = 16;  // from STX
constexpr std::size_t kTrailerBytes = 3;
constexpr std::uint8_t kStx = 2;
constexpr std::uint8_t kEtx = 3;
constexpr std::size_t kMaxBeams = 2048;
constexpr std::size_t kSectorBytes = 24;
constexpr std::size_t kBeamBytes = 16;
constexpr std::size_t kSoundingBytes = 20;
constexpr std::size_t kDepthBeamBytes = 16;
constexpr std::uint16_t kEm120 = 120;
constexpr std::uint16_t kEm300 = 300;
constexpr std::uint16_t kEm2040 = 2040;

// Reads numbers in the byte order of the datagram.
class EmReader {
 public:
  EmReader(Bytes bytes, bool big_endian) : in_(bytes), big_endian_(big_endian) {}
  explicit EmReader(const EmDatagram& datagram) : EmReader(datagram.body, datagram.big_endian) {}

  template <class T>
  T Get() {
    return big_endian_ ? in_.Be<T>() : in_.Le<T>();
  }
  double Degrees() { return Get<std::int16_t>() / 100.0; }
  void Skip(std::size_t n) { in_.Skip(n); }
  Bytes Take(std::size_t n) { return in_.Take(n); }
  bool ok() const { return in_.ok(); }
  std::size_t left() const { return in_.left(); }

 private:
  ByteReader in_;
  bool big_endian_;
};

// Midnight of a date as datagrams state it: a number with the digits of year, month and day.
std::optional<Time> MidnightOf(std::uint32_t date) {
  const auto digits = static_cast<int>(date % 100'000'000);
  return Midnight(digits / 10'000, digits / 100 % 100, digits % 100);
}

std::optional<EmDatagram> ReadIn(bool big_endian, Bytes datagram) {
  EmReader in(datagram, big_endian);
  const std::size_t length = in.Get<std::uint32_t>();
  if (length + kLengthBytes != datagram.size() || length < kHeaderBytes + kTrailerBytes)
    return std::nullopt;
  const Bytes all = datagram.subspan(kLengthBytes);
  if (all[0] != kStx || all[length - kTrailerBytes] != kEtx) return std::nullopt;
  const Bytes summed = all.subspan(1, length - kTrailerBytes - 1);
  const auto sum = std::accumulate(summed.begin(), summed.end(), std::uint32_t{0});
  const auto given = EmReader(all.last(2), big_endian).Get<std::uint16_t>();
  if (given != static_cast<std::uint16_t>(sum)) return std::nullopt;

  EmDatagram out;
  out.big_endian = big_endian;
  in.Skip(1);
  out.type = static_cast<char>(in.Get<std::uint8_t>());
  out.model = in.Get<std::uint16_t>();
  const std::optional<Time> midnight = MidnightOf(in.Get<std::uint32_t>());
  const std::int64_t milliseconds = in.Get<std::uint32_t>();
  out.counter = in.Get<std::uint16_t>();
  out.serial = in.Get<std::uint16_t>();
  if (!midnight || milliseconds >= 86'400'000) return std::nullopt;
  out.time = *midnight + std::chrono::milliseconds(milliseconds);
  out.body = all.subspan(kHeaderBytes, length - kHeaderBytes - kTrailerBytes);
  return out;
}

// Flags of a beam. cleaning is below 0 if the sonar's own filter rejected the beam.
std::uint8_t FlagsOf(std::uint8_t detection, std::int8_t cleaning) {
  constexpr std::uint8_t kInvalid = 0x80;
  const std::uint8_t method = detection & 0x0F;
  if ((detection & kInvalid) != 0 || method > 1) return 0;
  const std::uint8_t found = method == 0 ? kBeamAmplitude : kBeamPhase;
  return cleaning < 0 ? found : static_cast<std::uint8_t>(found | kBeamValid);
}

struct Sector {
  float tilt_rad = 0.0f;
  float delay_s = 0.0f;
  std::uint8_t array = 0;
};

Sector ReadSector(EmReader in, std::uint16_t model) {
  Sector sector;
  sector.tilt_rad = static_cast<float>(Deg2Rad(in.Degrees()));
  in.Skip(6);
  sector.delay_s = in.Get<float>();
  in.Skip(7);
  const auto number = in.Get<std::uint8_t>();
  if (model == kEm2040) sector.array = number;  // the other models have one array
  return sector;
}

// A beam; nothing if it is unusable.
std::optional<MbesBeam> ReadBeam(EmReader in, const std::vector<Sector>& sectors) {
  MbesBeam beam;
  beam.rx_angle_rad = static_cast<float>(-Deg2Rad(in.Degrees()));  // positive to port in the file
  const std::size_t sector = in.Get<std::uint8_t>();
  const auto detection = in.Get<std::uint8_t>();
  in.Skip(2);
  beam.depth_sigma_ratio = static_cast<float>(in.Get<std::uint8_t>()) / 2500.0f;
  in.Skip(1);
  beam.twtt_s = in.Get<float>();
  beam.backscatter_db = static_cast<float>(in.Get<std::int16_t>()) / 10.0f;
  beam.flags = FlagsOf(detection, in.Get<std::int8_t>());
  if (sector >= sectors.size()) return std::nullopt;
  beam.tx_tilt_rad = sectors[sector].tilt_rad;
  beam.tx_delay_s = sectors[sector].delay_s;
  beam.tx_array = sectors[sector].array;
  return IsUsable(beam) ? std::optional(beam) : std::nullopt;
}

PlacedBeam ReadSounding(EmReader in) {
  PlacedBeam out;
  const float z = in.Get<float>();
  const float y = in.Get<float>();
  const float x = in.Get<float>();
  in.Skip(2);
  const float quality = in.Get<std::uint8_t>();
  in.Skip(1);
  const auto detection = in.Get<std::uint8_t>();
  out.p_level_m = {x, y, z};
  if (!out.p_level_m.allFinite()) return {};
  out.sigma_z_m = quality / 250.0f * out.p_level_m.norm();
  out.flags = FlagsOf(detection, in.Get<std::int8_t>());
  return std::isfinite(out.sigma_z_m) ? out : PlacedBeam{};
}

// Roll, pitch [0.01 deg], heave [cm], heading [0.01 deg]: the same in both attitude datagrams.
void ReadMotion(EmReader* in, NavigationRecord* sample) {
  const double roll_deg = in->Degrees();
  const double pitch_deg = in->Degrees();
  const double heave_m = in->Get<std::int16_t>() / 100.0;
  const double heading_deg = in->Get<std::uint16_t>() / 100.0;
  sample->attitude = AttitudeFromDegrees(roll_deg, pitch_deg, heading_deg);
  sample->heave_m = heave_m;
}

std::string SourceOf(char type, std::uint8_t descriptor) {
  constexpr std::uint8_t kSecondSensor = 1 << 4;
  return std::string(1, type) + ((descriptor & kSecondSensor) != 0 ? '2' : '1');
}

// Time of day from hhmmss.ss of a GGA sentence.
std::optional<Duration> TimeOfGga(std::string_view text) {
  const std::size_t name = text.find("GGA,");
  if (name == std::string_view::npos) return std::nullopt;
  return TimeOfDayFromNmea(Split(text.substr(name + 4), ',').front());
}

}  // namespace

std::optional<EmDatagram> ReadEmDatagram(Bytes datagram) {
  auto little = ReadIn(false, datagram);
  return little ? little : ReadIn(true, datagram);
}

std::optional<MbesPing> DecodeEmN(const EmDatagram& datagram,
                                  std::uint8_t head,
                                  int* unusable_beams) {
  EmReader in(datagram);
  MbesPing ping;
  ping.time = datagram.time;
  ping.ping_number = datagram.counter;
  ping.head = head;
  ping.sound_speed_mps = in.Get<std::uint16_t>() / 10.0;  // 0: the sonar has none
  const std::size_t num_sectors = in.Get<std::uint16_t>();
  const std::size_t num_beams = in.Get<std::uint16_t>();
  in.Skip(2 + 4 + 4);
  if (!in.ok() || num_beams > kMaxBeams ||
      in.left() < num_sectors * kSectorBytes + num_beams * kBeamBytes)
    return std::nullopt;
  std::vector<Sector> sectors;
  for (std::size_t i = 0; i < num_sectors; ++i)
    sectors.push_back(
        ReadSector(EmReader(in.Take(kSectorBytes), datagram.big_endian), datagram.model));
  int unusable = 0;
  for (std::size_t i = 0; i < num_beams; ++i) {
    const auto beam = ReadBeam(EmReader(in.Take(kBeamBytes), datagram.big_endian), sectors);
    if (!beam) ++unusable;
    ping.beams.push_back(beam.value_or(MbesBeam{}));
  }
  if (unusable_beams != nullptr) *unusable_beams = unusable;
  return ping;
}

// The ping of a datagram of soundings, without them.
static PlacedPing PlacedPingOf(const EmDatagram& datagram,
                               std::uint8_t head,
                               const SonarInstallation& installation) {
  PlacedPing ping;
  ping.time = datagram.time;
  ping.ping_number = datagram.counter;
  ping.head = head;
  ping.p_vehicle_origin_m = EmSoundingOrigin(installation);
  return ping;
}

std::optional<NavigationRecord> DecodeEmPingHeading(const EmDatagram& datagram) {
  EmReader in(datagram);
  const double heading_deg = in.Get<std::uint16_t>() / 100.0;
  if (!in.ok() || heading_deg > 360.0) return std::nullopt;
  NavigationRecord record;
  record.time = datagram.time;
  record.attitude = AttitudeFromDegrees(0.0, 0.0, heading_deg);
  record.source = "em_ping";
  return record;
}

std::optional<PlacedPing> DecodeEmX(const EmDatagram& datagram,
                                    std::uint8_t head,
                                    const SonarInstallation& installation) {
  EmReader in(datagram);
  in.Skip(4);  // heading, sound speed
  PlacedPing ping = PlacedPingOf(datagram, head, installation);
  ping.origin_depth_m = in.Get<float>();
  const std::size_t num_beams = in.Get<std::uint16_t>();
  in.Skip(10);
  if (!in.ok() || num_beams > kMaxBeams || in.left() < num_beams * kSoundingBytes ||
      !std::isfinite(*ping.origin_depth_m))
    return std::nullopt;
  for (std::size_t i = 0; i < num_beams; ++i)
    ping.soundings.push_back(ReadSounding(EmReader(in.Take(kSoundingBytes), datagram.big_endian)));
  return ping;
}

std::optional<PlacedPing> DecodeEmD(const EmDatagram& datagram,
                                    std::uint8_t head,
                                    const SonarInstallation& installation) {
  constexpr std::uint8_t kFoundByPhase = 0x80;  // a flag of the quality
  EmReader in(datagram);
  in.Skip(4);  // heading, sound speed
  PlacedPing ping = PlacedPingOf(datagram, head, installation);
  const double depth_cm = in.Get<std::uint16_t>();
  in.Skip(1);  // largest number of beams
  const std::size_t num_beams = in.Get<std::uint8_t>();
  const double unit_z_m = in.Get<std::uint8_t>() / 100.0;
  const double unit_xy_m = in.Get<std::uint8_t>() / 100.0;
  in.Skip(2);  // sampling rate
  const Bytes beams = in.Take(num_beams * kDepthBeamBytes);
  ping.origin_depth_m = (depth_cm + 65'536.0 * in.Get<std::int8_t>()) / 100.0;
  if (!in.ok()) return std::nullopt;
  for (std::size_t i = 0; i < num_beams; ++i) {
    EmReader beam_in(beams.subspan(i * kDepthBeamBytes, kDepthBeamBytes), datagram.big_endian);
    const auto z = beam_in.Get<std::uint16_t>();
    const double y_m = beam_in.Get<std::int16_t>() * unit_xy_m;
    const double x_m = beam_in.Get<std::int16_t>() * unit_xy_m;
    beam_in.Skip(6);  // angles and range
    PlacedBeam beam;
    const bool deep = datagram.model == kEm120 || datagram.model == kEm300;
    const double z_m = (deep ? int{z} : int{static_cast<std::int16_t>(z)}) * unit_z_m;
    beam.p_level_m = Eigen::Vector3d(x_m, y_m, z_m).cast<float>();
    const bool phase = (beam_in.Get<std::uint8_t>() & kFoundByPhase) != 0;
    beam.flags = kBeamValid | (phase ? kBeamPhase : kBeamAmplitude);
    ping.soundings.push_back(beam);
  }
  return ping;
}

std::optional<std::vector<NavigationRecord>> DecodeEmA(const EmDatagram& datagram) {
  constexpr std::size_t kSampleBytes = 12;
  EmReader in(datagram);
  const std::size_t count = in.Get<std::uint16_t>();
  const Bytes bytes = in.Take(count * kSampleBytes);
  const auto descriptor = in.Get<std::uint8_t>();
  if (!in.ok()) return std::nullopt;
  std::vector<NavigationRecord> samples;
  for (std::size_t i = 0; i < count; ++i) {
    EmReader sample_in(bytes.subspan(i * kSampleBytes, kSampleBytes), datagram.big_endian);
    NavigationRecord sample;
    sample.source = SourceOf('A', descriptor);
    sample.time = datagram.time + std::chrono::milliseconds(sample_in.Get<std::uint16_t>());
    sample.status = sample_in.Get<std::uint16_t>();
    const std::uint32_t sensor = sample.status & 0xFF;
    const bool valid = sensor < 0x9A || sensor > 0xAF;
    if (valid) ReadMotion(&sample_in, &sample);
    samples.push_back(std::move(sample));
  }
  return samples;
}

std::optional<std::vector<NavigationRecord>> DecodeEmNetworkAttitude(const EmDatagram& datagram) {
  EmReader in(datagram);
  const std::size_t count = in.Get<std::uint16_t>();
  const auto descriptor = in.Get<std::uint8_t>();
  in.Skip(1);
  std::vector<NavigationRecord> samples;
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    NavigationRecord sample;
    sample.source = SourceOf('n', descriptor);
    sample.time = datagram.time + std::chrono::milliseconds(in.Get<std::uint16_t>());
    ReadMotion(&in, &sample);
    in.Skip(in.Get<std::uint8_t>());  // the sensor's own message
    samples.push_back(std::move(sample));
  }
  if (!in.ok()) return std::nullopt;
  constexpr std::uint8_t kNotUsed = 0xFF;
  if (descriptor == kNotUsed) samples.clear();
  return samples;
}

std::optional<NavigationRecord> DecodeEmP(const EmDatagram& datagram,
                                          const SonarInstallation& installation) {
  constexpr std::uint8_t kActiveByItsOwnTime = 0xC0;
  constexpr double kNoQuality = 65535.0;
  EmReader in(datagram);
  const double latitude_deg = in.Get<std::int32_t>() / 2e7;
  const double longitude_deg = in.Get<std::int32_t>() / 1e7;
  const double quality_cm = in.Get<std::uint16_t>();
  const auto speed_cmps = in.Get<std::uint16_t>();
  const auto course_cdeg = in.Get<std::uint16_t>();
  in.Skip(2);  // heading
  const auto descriptor = in.Get<std::uint8_t>();
  const std::string raw = TextFromBytes(in.Take(in.Get<std::uint8_t>()));
  if (!in.ok() || std::abs(latitude_deg) > 90.0 || std::abs(longitude_deg) > 180.0)
    return std::nullopt;
  NavigationRecord sample;
  sample.source = "P" + std::to_string(std::max(1, descriptor & 3));
  sample.status = descriptor;
  sample.time = datagram.time;
  if ((descriptor & kActiveByItsOwnTime) == kActiveByItsOwnTime)
    if (const auto time_of_day = TimeOfGga(raw)) {
      sample.time = NearestTimeOfDay(*time_of_day, datagram.time);
      sample.arrival = datagram.time;
    }
  if (const InstalledSensor* const sensor = installation.SensorOf(sample.source);
      sensor != nullptr && std::abs(sensor->delay_s) < 60.0)
    sample.time -= FromSeconds(sensor->delay_s);
  const double sigma_m = quality_cm < kNoQuality ? quality_cm / 100.0 : 0.0;
  sample.position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg), {sigma_m, sigma_m}};
  constexpr std::uint16_t kNotGiven = 0xFFFF;
  if (speed_cmps != kNotGiven && course_cdeg < 36000) {
    const double course_rad = Deg2Rad(course_cdeg / 100.0);
    sample.velocity = GeoVelocity{speed_cmps / 100.0 *
                                  Eigen::Vector3d(std::cos(course_rad), std::sin(course_rad), 0.0)};
  }
  return sample;
}

std::optional<NavigationRecord> DecodeEmHeight(const EmDatagram& datagram) {
  constexpr std::uint8_t kOfWaterLine = 0;
  EmReader in(datagram);
  const double height_cm = in.Get<std::int32_t>();
  const auto type = in.Get<std::uint8_t>();
  if (!in.ok()) return std::nullopt;
  NavigationRecord sample;
  sample.time = datagram.time;
  sample.source = "h";
  sample.status = type;
  if (type == kOfWaterLine) sample.water_line_height_m = height_cm / 100.0;
  return sample;
}

std::optional<ClockComparison> DecodeEmC(const EmDatagram& datagram) {
  constexpr std::uint32_t kDayMs = 86'400'000;
  EmReader in(datagram);
  const std::optional<Time> midnight = MidnightOf(in.Get<std::uint32_t>());
  const auto time_of_day_ms = in.Get<std::uint32_t>();
  if (!in.ok() || !midnight || time_of_day_ms >= kDayMs) return std::nullopt;
  return ClockComparison{datagram.time, *midnight + std::chrono::milliseconds(time_of_day_ms), "C"};
}

std::optional<SoundVelocityProfile> DecodeEmU(const EmDatagram& datagram) {
  EmReader in(datagram);
  const std::optional<Time> midnight = MidnightOf(in.Get<std::uint32_t>());
  // Milliseconds of the day by the manual; seconds in real files.
  const std::int64_t time = in.Get<std::uint32_t>();
  const std::size_t count = in.Get<std::uint16_t>();
  const double resolution_m = in.Get<std::uint16_t>() / 100.0;
  if (!in.ok() || in.left() < 8 * count) return std::nullopt;
  // A cast stamped in a ship's local time can lie ahead of the sonar's clock; the profile is in use
  // from this datagram on.
  Time cast = datagram.time;
  if (midnight)
    cast = std::min(cast,
                    *midnight + (time < 86'400 ? Duration(std::chrono::seconds(time))
                                               : Duration(std::chrono::milliseconds(time))));
  std::vector<ProfileRow> rows(count);
  for (ProfileRow& row : rows) {
    row.depth_m = in.Get<std::uint32_t>() * resolution_m;
    row.speed_mps = in.Get<std::uint32_t>() / 10.0;
  }
  return ProfileFrom(cast, std::move(rows));
}

std::optional<std::vector<SurfaceSoundSpeed>> DecodeEmG(const EmDatagram& datagram) {
  EmReader in(datagram);
  const std::size_t count = in.Get<std::uint16_t>();
  if (!in.ok() || in.left() < 4 * count) return std::nullopt;
  std::vector<SurfaceSoundSpeed> speeds;
  for (std::size_t i = 0; i < count; ++i) {
    const Time time = datagram.time + std::chrono::seconds(in.Get<std::uint16_t>());
    const double speed_mps = in.Get<std::uint16_t>() / 10.0;
    if (speed_mps > 0.0) speeds.push_back({time, speed_mps});
  }
  return speeds;
}

}  // namespace seastitch
