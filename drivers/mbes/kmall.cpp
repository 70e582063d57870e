#include "drivers/mbes/kmall.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/core/pose.hpp"
#include "drivers/mbes/mbes_codec.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kHeaderBytes = kKmallHeaderBytes;
constexpr std::size_t kPartitionBytes = kKmallPartitionBytes;
constexpr std::size_t kTailBytes = kKmallTailBytes;

constexpr std::size_t kMaxMainBeams = 1024;
constexpr std::size_t kMaxExtraDetections = 1024;
constexpr std::size_t kMaxProfileSamples = 2000;
constexpr std::size_t kMaxMotionSamples = 148;
constexpr double kNoPosition_deg = 200.0;

// Sizes of the structures up to the last field that is read, by which a datagram that claims less
// is refused; and sizes that we write, those of version 1 to 3 and of version 0.
constexpr std::size_t kCommonBytes = 12;
constexpr std::size_t kPingInfoBytes = 152;
constexpr std::size_t kPingInfoBytesV0 = 144;
constexpr std::size_t kSectorBytes = 48;
constexpr std::size_t kSectorBytesV0 = 36;
constexpr std::size_t kRxInfoBytes = 32;
constexpr std::size_t kSoundingBytes = 120;
constexpr std::size_t kSvpInfoBytes = 28;
constexpr std::size_t kSkmInfoBytes = 12;
constexpr std::size_t kSvtInfoBytes = 20;

enum DetectionType : std::uint8_t { kNormal = 0, kExtra = 1, kRejected = 2 };
enum DetectionMethod : std::uint8_t { kNoMethod = 0, kAmplitude = 1, kPhase = 2 };

struct Sector {
  float tilt_rad = 0.0f;
  float delay_s = 0.0f;
};

std::uint32_t LastWord(Bytes datagram) {
  return ByteReader(datagram.last(kTailBytes)).Le<std::uint32_t>();
}

std::optional<Bytes> WholeDatagram(Bytes datagram, std::string_view type) {
  const std::optional<KmallHeader> header = ReadKmallHeader(datagram);
  if (!header || !header->Is(type) || header->time_s == 0) return std::nullopt;
  if (LastWord(datagram) != datagram.size()) return std::nullopt;
  return datagram.subspan(0, datagram.size() - kTailBytes);
}

// The structures of an #MRZ, each a part of the datagram's bytes.
struct MrzLayout {
  Bytes common;
  Bytes ping_info;
  Bytes sectors;
  std::size_t bytes_per_sector = 0;
  Bytes soundings;  // main detections, then extra ones
  std::size_t bytes_per_sounding = 0;
  std::size_t num_main = 0;
};

// A structure that begins with its own size.
Bytes TakeSized(ByteReader* in, Bytes all, std::size_t least) {
  if (in->left() < 2) {
    in->Skip(2);
    return {};
  }
  const std::size_t size = ByteReader(all.subspan(in->at())).Le<std::uint16_t>();
  return size < least ? in->Take(in->left() + 1) : in->Take(size);
}

// Nothing unless the structures fill the datagram to its last byte (from header to seabed image
// and tail).
std::optional<MrzLayout> ReadMrzLayout(Bytes datagram) {
  const std::optional<Bytes> body = WholeDatagram(datagram, "#MRZ");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kHeaderBytes + kPartitionBytes);
  MrzLayout layout;
  layout.common = TakeSized(&in, *body, kCommonBytes);
  layout.ping_info = TakeSized(&in, *body, kPingInfoBytesV0);
  if (!in.ok()) return std::nullopt;

  ByteReader info(layout.ping_info);
  info.Skip(92);
  const std::size_t num_sectors = info.Le<std::uint16_t>();
  layout.bytes_per_sector = info.Le<std::uint16_t>();
  if (layout.bytes_per_sector < kSectorBytesV0) return std::nullopt;
  layout.sectors = in.Take(num_sectors * layout.bytes_per_sector);

  const Bytes rx_info = TakeSized(&in, *body, kRxInfoBytes);
  if (!in.ok()) return std::nullopt;
  ByteReader rx(rx_info);
  rx.Skip(2);
  layout.num_main = rx.Le<std::uint16_t>();
  rx.Skip(2);
  layout.bytes_per_sounding = rx.Le<std::uint16_t>();
  rx.Skip(18);
  const std::size_t num_extra = rx.Le<std::uint16_t>();
  const std::size_t num_classes = rx.Le<std::uint16_t>();
  const std::size_t bytes_per_class = rx.Le<std::uint16_t>();
  if (layout.bytes_per_sounding < kSoundingBytes || layout.num_main > kMaxMainBeams ||
      num_extra > kMaxExtraDetections)
    return std::nullopt;
  in.Skip(num_classes * bytes_per_class);
  const std::size_t num_soundings = layout.num_main + num_extra;
  layout.soundings = in.Take(num_soundings * layout.bytes_per_sounding);
  if (!in.ok()) return std::nullopt;

  std::size_t image_samples = 0;
  for (std::size_t i = 0; i < num_soundings; ++i) {
    ByteReader sounding(layout.soundings.subspan(i * layout.bytes_per_sounding));
    sounding.Skip(118);
    image_samples += sounding.Le<std::uint16_t>();
  }
  if (in.left() != 2 * image_samples) return std::nullopt;
  return layout;
}

// Samples of one size behind an info part that says how many there are: u16 count and u16 size at
// `at` of the info.
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
  const std::optional<Bytes> body = WholeDatagram(datagram, type);
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kHeaderBytes);
  ByteReader info(TakeSized(&in, *body, least_info_bytes));
  info.Skip(at);
  SampleArray samples;
  samples.count = info.Le<std::uint16_t>();
  samples.bytes_each = info.Le<std::uint16_t>();
  samples.bytes = in.Take(samples.count * samples.bytes_each);
  const bool usable =
      in.ok() && info.ok() && samples.count <= most && samples.bytes_each >= least_bytes_each;
  return usable ? std::optional(samples) : std::nullopt;
}

Time ReadTime(ByteReader* in) {
  const std::int64_t seconds = in->Le<std::uint32_t>();
  const std::int64_t nanoseconds = in->Le<std::uint32_t>();
  return FromUtime(seconds * 1'000'000 + (nanoseconds + 500) / 1000);
}

std::vector<Sector> ReadSectors(const MrzLayout& layout) {
  std::vector<Sector> sectors(layout.sectors.size() / layout.bytes_per_sector);
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    ByteReader in(layout.sectors.subspan(i * layout.bytes_per_sector));
    in.Skip(4);
    sectors[i].delay_s = in.Le<float>();
    sectors[i].tilt_rad = static_cast<float>(Deg2Rad(in.Le<float>()));
  }
  return sectors;
}

struct ReadBeam {
  DetectionType type;
  std::optional<MbesBeam> beam;  // nothing: unusable
};

ReadBeam ReadSounding(Bytes sounding, const std::vector<Sector>& sectors) {
  ByteReader in(sounding);
  in.Skip(2);
  const std::size_t sector = in.Le<std::uint8_t>();
  const auto type = static_cast<DetectionType>(in.Le<std::uint8_t>());
  const auto method = in.Le<std::uint8_t>();
  in.Skip(11);
  const float quality_percent = in.Le<float>();
  in.Skip(28);
  const float reflectivity_db = in.Le<float>();
  in.Skip(20);
  const float angle_to_port_deg = in.Le<float>();
  in.Skip(4);
  const float twtt_s = in.Le<float>();
  if (sector >= sectors.size()) return {type, std::nullopt};

  MbesBeam beam;
  beam.twtt_s = twtt_s;
  beam.rx_angle_rad = static_cast<float>(-Deg2Rad(angle_to_port_deg));
  beam.tx_tilt_rad = sectors[sector].tilt_rad;
  beam.tx_delay_s = sectors[sector].delay_s;
  beam.depth_sigma_ratio = static_cast<float>(std::max(double{quality_percent}, 0.0) / 100.0);
  beam.backscatter_db = reflectivity_db;
  if (method == kAmplitude) beam.flags |= kBeamAmplitude;
  if (method == kPhase) beam.flags |= kBeamPhase;
  if (type == kNormal && beam.flags != 0) beam.flags |= kBeamValid;
  return {type, IsUsable(beam) ? std::optional(beam) : std::nullopt};
}

void WriteHeader(const KmallHeader& header, Time time, ByteWriter* out) {
  out->Le(std::uint32_t{0});  // size, known at the end
  for (const char c : header.type) out->Le(static_cast<std::uint8_t>(c));
  out->Le(header.version);
  out->Le(header.system_id);
  out->Le(header.echo_sounder_id);
  out->Le(static_cast<std::uint32_t>(ToUtime(time) / 1'000'000));
  out->Le(static_cast<std::uint32_t>(ToUtime(time) % 1'000'000 * 1000));
}

struct Sectors {
  std::vector<Sector> list;
  std::vector<std::uint8_t> of_beam;
};

Sectors GroupIntoSectors(const MbesPing& ping) {
  Sectors sectors;
  for (const MbesBeam& beam : ping.beams) {
    const auto same = [&beam](const Sector& s) {
      return s.tilt_rad == beam.tx_tilt_rad && s.delay_s == beam.tx_delay_s;
    };
    const auto found = std::find_if(sectors.list.begin(), sectors.list.end(), same);
    sectors.of_beam.push_back(static_cast<std::uint8_t>(found - sectors.list.begin()));
    if (found == sectors.list.end()) sectors.list.push_back({beam.tx_tilt_rad, beam.tx_delay_s});
    if (sectors.list.size() > 255) throw std::invalid_argument("#MRZ: more than 255 sectors");
  }
  return sectors;
}

void WriteSector(const Sector& sector, std::uint8_t number, std::size_t size, ByteWriter* out) {
  out->Le(number);
  out->Zeros(3);
  out->Le(sector.delay_s);
  out->Le(static_cast<float>(Rad2Deg(sector.tilt_rad)));
  out->Zeros(size - 12);
}

void WriteSounding(const MbesBeam& beam,
                   std::uint16_t index,
                   std::uint8_t sector,
                   ByteWriter* out) {
  const bool valid = (beam.flags & kBeamValid) != 0;
  const std::uint8_t method = (beam.flags & kBeamPhase) != 0       ? kPhase
                              : (beam.flags & kBeamAmplitude) != 0 ? kAmplitude
                                                                   : kNoMethod;
  out->Le(index);
  out->Le(sector);
  out->Le(static_cast<std::uint8_t>(valid ? kNormal : kRejected));
  out->Le(method);
  out->Zeros(7);
  out->Le(100.0f);  // range factor, %
  out->Le(beam.depth_sigma_ratio * 100.0f);
  out->Zeros(28);
  out->Le(beam.backscatter_db);
  out->Zeros(20);
  out->Le(static_cast<float>(-Rad2Deg(beam.rx_angle_rad)));
  out->Zeros(4);
  out->Le(beam.twtt_s);
  out->Zeros(36);
}

}  // namespace

Time KmallHeader::time() const {
  return FromUtime(static_cast<std::int64_t>(time_s) * 1'000'000 +
                   (static_cast<std::int64_t>(time_ns) + 500) / 1000);
}

std::optional<KmallHeader> ReadKmallHeader(Bytes datagram) {
  if (datagram.size() < kHeaderBytes + kTailBytes) return std::nullopt;
  ByteReader in(datagram);
  KmallHeader header;
  header.num_bytes = in.Le<std::uint32_t>();
  for (char& c : header.type) c = static_cast<char>(in.Le<std::uint8_t>());
  header.version = in.Le<std::uint8_t>();
  header.system_id = in.Le<std::uint8_t>();
  header.echo_sounder_id = in.Le<std::uint16_t>();
  header.time_s = in.Le<std::uint32_t>();
  header.time_ns = in.Le<std::uint32_t>();
  const bool usable = header.type[0] == '#' && header.num_bytes == datagram.size() &&
                      header.time_ns < 1'000'000'000;
  return usable ? std::optional(header) : std::nullopt;
}

bool IsWholeMrz(Bytes datagram) { return ReadMrzLayout(datagram).has_value(); }

std::vector<std::uint8_t> SealKmall(ByteWriter* out) {
  out->Le(std::uint32_t{0});
  std::vector<std::uint8_t> bytes = out->Release();
  for (std::size_t i = 0; i < 4; ++i)
    bytes[i] = bytes[bytes.size() - kTailBytes + i] =
        static_cast<std::uint8_t>(bytes.size() >> (8 * i));
  return bytes;
}

std::size_t ReceiverOfMrz(Bytes datagram) {
  ByteReader in(datagram);
  in.Skip(33);
  return in.Le<std::uint8_t>();
}

std::optional<MbesPing> DecodeMrz(Bytes datagram, int* unusable_beams) {
  const std::optional<MrzLayout> layout = ReadMrzLayout(datagram);
  if (!layout) return std::nullopt;
  const KmallHeader header = *ReadKmallHeader(datagram);
  if (header.version > kNewestMrz) return std::nullopt;

  MbesPing ping;
  ping.time = header.time();
  ByteReader common(layout->common);
  common.Skip(2);
  ping.ping_number = common.Le<std::uint16_t>();
  ByteReader info(layout->ping_info);
  info.Skip(100);
  ping.sound_speed_mps = info.Le<float>();
  if (!std::isfinite(ping.sound_speed_mps) || ping.sound_speed_mps <= 0.0) return std::nullopt;

  const std::vector<Sector> sectors = ReadSectors(*layout);
  ping.beams.reserve(layout->num_main);
  int unusable = 0;
  for (std::size_t i = 0; i < layout->num_main; ++i) {
    const ReadBeam read =
        ReadSounding(layout->soundings.subspan(i * layout->bytes_per_sounding), sectors);
    if (read.type == kExtra) continue;
    if (!read.beam) ++unusable;
    ping.beams.push_back(read.beam.value_or(MbesBeam{}));
  }
  if (unusable_beams != nullptr) *unusable_beams = unusable;
  return ping;
}

std::vector<std::uint8_t> EncodeMrz(const MbesPing& ping, const KmallHeader& header) {
  if (ping.beams.size() > kMaxMainBeams) throw std::invalid_argument("#MRZ: more than 1024 beams");
  const bool v0 = header.version == 0;
  const std::size_t info_bytes = v0 ? kPingInfoBytesV0 : kPingInfoBytes;
  const std::size_t sector_bytes = v0 ? kSectorBytesV0 : kSectorBytes;
  const Sectors sectors = GroupIntoSectors(ping);
  const auto num_valid = std::count_if(ping.beams.begin(), ping.beams.end(), [](const MbesBeam& b) {
    return (b.flags & kBeamValid) != 0;
  });

  ByteWriter out;
  WriteHeader(header, ping.time, &out);
  out.Le(std::uint16_t{1});  // parts
  out.Le(std::uint16_t{1});  // this one

  out.Le(static_cast<std::uint16_t>(kCommonBytes));
  out.Le(static_cast<std::uint16_t>(ping.ping_number));
  out.Le(std::uint8_t{1});  // fans of this ping
  out.Zeros(1);
  out.Le(std::uint8_t{1});  // swaths of this ping
  out.Zeros(3);
  out.Le(std::uint8_t{1});  // receivers
  out.Zeros(1);

  out.Le(static_cast<std::uint16_t>(info_bytes));
  out.Zeros(90);
  out.Le(static_cast<std::uint16_t>(sectors.list.size()));
  out.Le(static_cast<std::uint16_t>(sector_bytes));
  out.Zeros(4);
  out.Le(static_cast<float>(ping.sound_speed_mps));
  out.Zeros(20);
  out.Le(200.0);  // latitude and longitude: not available
  out.Le(200.0);
  out.Le(-999.0f);  // height: not available
  out.Zeros(info_bytes - kPingInfoBytesV0);

  for (std::size_t i = 0; i < sectors.list.size(); ++i)
    WriteSector(sectors.list[i], static_cast<std::uint8_t>(i), sector_bytes, &out);

  out.Le(static_cast<std::uint16_t>(kRxInfoBytes));
  out.Le(static_cast<std::uint16_t>(ping.beams.size()));
  out.Le(static_cast<std::uint16_t>(num_valid));
  out.Le(static_cast<std::uint16_t>(kSoundingBytes));
  out.Zeros(22);
  out.Le(std::uint16_t{4});  // size of an extra detection class, of which there is none

  for (std::size_t i = 0; i < ping.beams.size(); ++i)
    WriteSounding(ping.beams[i], static_cast<std::uint16_t>(i), sectors.of_beam[i], &out);
  return SealKmall(&out);
}

std::optional<SoundVelocityProfile> DecodeSvp(Bytes datagram) {
  const std::optional<Bytes> body = WholeDatagram(datagram, "#SVP");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kHeaderBytes);
  const Bytes info_bytes = TakeSized(&in, *body, kSvpInfoBytes);
  if (!in.ok()) return std::nullopt;
  ByteReader info(info_bytes);
  info.Skip(2);
  const std::size_t num_samples = info.Le<std::uint16_t>();
  info.Skip(4);
  const auto cast_time_s = info.Le<std::uint32_t>();
  // Files of sonars in service have stray text behind the samples.
  if (num_samples > kMaxProfileSamples || in.left() < num_samples * 20) return std::nullopt;

  SoundVelocityProfile profile;
  profile.time = cast_time_s == 0 ? ReadKmallHeader(datagram)->time()
                                  : FromUtime(std::int64_t{cast_time_s} * 1'000'000);
  for (std::size_t i = 0; i < num_samples; ++i) {
    const double depth_m = in.Le<float>();
    const double speed_mps = in.Le<float>();
    in.Skip(12);
    if (!std::isfinite(depth_m) || !std::isfinite(speed_mps) || speed_mps <= 0.0)
      return std::nullopt;
    if (!profile.depth_m.empty() && depth_m <= profile.depth_m.back()) continue;
    profile.depth_m.push_back(depth_m);
    profile.speed_mps.push_back(speed_mps);
  }
  if (profile.depth_m.empty()) return std::nullopt;
  return profile;
}

std::vector<std::uint8_t> EncodeSvp(const SoundVelocityProfile& profile,
                                    const KmallHeader& header) {
  const std::size_t num_samples = std::min(profile.depth_m.size(), profile.speed_mps.size());
  if (num_samples > kMaxProfileSamples) throw std::invalid_argument("#SVP: more than 2000 samples");
  KmallHeader svp = header;
  svp.type = {'#', 'S', 'V', 'P'};
  svp.version = 1;
  ByteWriter out;
  WriteHeader(svp, profile.time, &out);
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

std::optional<KmallPosition> DecodeSpo(Bytes datagram) {
  const std::optional<Bytes> body = WholeDatagram(datagram, "#SPO");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kHeaderBytes);
  TakeSized(&in, *body, 8);
  in.Skip(12);  // time as the sensor gave it, and quality
  const double latitude_deg = in.Le<double>();
  const double longitude_deg = in.Le<double>();
  in.Skip(12);
  if (!in.ok() || !(std::abs(latitude_deg) <= 90.0) || !(std::abs(longitude_deg) < kNoPosition_deg))
    return std::nullopt;
  return KmallPosition{
      ReadKmallHeader(datagram)->time(), Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
}

std::optional<std::vector<KmallMotion>> DecodeSkm(Bytes datagram) {
  const std::optional<SampleArray> samples =
      ReadSamples(datagram, "#SKM", kSkmInfoBytes, 6, kMaxMotionSamples, 120);
  if (!samples) return std::nullopt;
  std::vector<KmallMotion> motion;
  for (std::size_t i = 0; i < samples->count; ++i) {
    ByteReader in(samples->bytes.subspan(i * samples->bytes_each));
    in.Skip(8);
    KmallMotion m;
    m.time = ReadTime(&in);
    const auto status = in.Le<std::uint32_t>();
    in.Skip(20);
    m.roll_rad = Deg2Rad(in.Le<float>());
    m.pitch_rad = Deg2Rad(in.Le<float>());
    m.heading_rad = Deg2Rad(in.Le<float>());
    m.heave_m = in.Le<float>();
    constexpr std::uint32_t kRollPitchHeadingHeaveInvalid = 0b1110;
    m.valid = (status & kRollPitchHeadingHeaveInvalid) == 0 && std::isfinite(m.roll_rad) &&
              std::isfinite(m.pitch_rad) && std::isfinite(m.heading_rad) &&
              std::isfinite(m.heave_m);
    motion.push_back(m);
  }
  return motion;
}

std::optional<std::vector<KmallSurfaceSoundSpeed>> DecodeSvt(Bytes datagram) {
  const std::optional<SampleArray> samples =
      ReadSamples(datagram, "#SVT", kSvtInfoBytes, 6, kMaxMotionSamples, 24);
  if (!samples) return std::nullopt;
  std::vector<KmallSurfaceSoundSpeed> speeds;
  for (std::size_t i = 0; i < samples->count; ++i) {
    ByteReader in(samples->bytes.subspan(i * samples->bytes_each));
    const Time time = ReadTime(&in);
    const double speed_mps = in.Le<float>();
    if (!std::isfinite(speed_mps) || speed_mps <= 0.0) return std::nullopt;
    speeds.push_back({time, speed_mps});
  }
  return speeds;
}

}  // namespace seastitch
