#include "codecs/kongsberg/kmall.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "codecs/mbes_codec.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kHeaderBytes = kKmallHeaderBytes;
constexpr std::size_t kPartitionBytes = kKmallPartitionBytes;

constexpr std::size_t kMaxMainBeams = 1024;
constexpr std::size_t kMaxExtraDetections = 1024;

// Smallest accepted sizes of the structures: up to the last field that is read. Also the sizes that
// the writer uses, for versions 1 to 3 and for version 0.
constexpr std::size_t kCommonBytes = 12;
constexpr std::size_t kPingInfoBytes = 152;
constexpr std::size_t kPingInfoBytesV0 = 144;
constexpr std::size_t kSectorBytes = 48;
constexpr std::size_t kSectorBytesV0 = 36;
constexpr std::size_t kRxInfoBytes = 32;
constexpr std::size_t kSoundingBytes = 120;

constexpr double kNoHeight_m = -999.0;

enum DetectionType : std::uint8_t { kNormal = 0, kExtra = 1, kRejected = 2 };
enum DetectionMethod : std::uint8_t { kNoMethod = 0, kAmplitude = 1, kPhase = 2 };

struct Sector {
  float tilt_rad = 0.0f;
  float delay_s = 0.0f;
  std::uint8_t sub_array = 0;
  friend bool operator==(const Sector&, const Sector&) = default;
};

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

// The structures' places; nothing unless header, structures, seabed image and tail together fill
// the datagram exactly.
std::optional<MrzLayout> ReadMrzLayout(Bytes datagram) {
  const std::optional<Bytes> body = WholeKmall(datagram, "#MRZ");
  if (!body) return std::nullopt;
  ByteReader in(*body);
  in.Skip(kHeaderBytes + kPartitionBytes);
  MrzLayout layout;
  layout.common = TakeSizedKmall(&in, *body, kCommonBytes);
  layout.ping_info = TakeSizedKmall(&in, *body, kPingInfoBytesV0);
  if (!in.ok()) return std::nullopt;

  ByteReader info(layout.ping_info);
  info.Skip(92);
  const std::size_t num_sectors = info.Le<std::uint16_t>();
  layout.bytes_per_sector = info.Le<std::uint16_t>();
  if (layout.bytes_per_sector < kSectorBytesV0) return std::nullopt;
  layout.sectors = in.Take(num_sectors * layout.bytes_per_sector);

  const Bytes rx_info = TakeSizedKmall(&in, *body, kRxInfoBytes);
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

std::vector<Sector> ReadSectors(const MrzLayout& layout) {
  std::vector<Sector> sectors(layout.sectors.size() / layout.bytes_per_sector);
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    ByteReader in(layout.sectors.subspan(i * layout.bytes_per_sector));
    in.Skip(2);
    sectors[i].sub_array = in.Le<std::uint8_t>();
    in.Skip(1);
    sectors[i].delay_s = in.Le<float>();
    sectors[i].tilt_rad = static_cast<float>(Deg2Rad(in.Le<float>()));
  }
  return sectors;
}

struct ReadBeam {
  DetectionType type;
  std::optional<MbesBeam> beam;  // nothing if unusable
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
  beam.tx_array = sectors[sector].sub_array;
  beam.depth_sigma_ratio = static_cast<float>(std::max(double{quality_percent}, 0.0) / 100.0);
  beam.backscatter_db = reflectivity_db;
  if (method == kAmplitude) beam.flags |= kBeamAmplitude;
  if (method == kPhase) beam.flags |= kBeamPhase;
  if (type == kNormal && beam.flags != 0) beam.flags |= kBeamValid;
  return {type, IsUsable(beam) ? std::optional(beam) : std::nullopt};
}

PlacedBeam ReadPlaced(Bytes sounding, const MbesBeam& raw) {
  ByteReader in(sounding);
  in.Skip(96);
  const float z_m = in.Le<float>();
  const float y_m = in.Le<float>();
  const float x_m = in.Le<float>();
  const Eigen::Vector3f p_level_m(x_m, y_m, z_m);
  const float sigma_z_m = raw.depth_sigma_ratio * std::abs(z_m);
  if (!p_level_m.allFinite() || !std::isfinite(sigma_z_m)) return {};
  return {p_level_m, sigma_z_m, raw.flags};
}

struct Sectors {
  std::vector<Sector> list;
  std::vector<std::uint8_t> of_beam;
};

Sectors GroupIntoSectors(const MbesPing& ping) {
  Sectors sectors;
  for (const MbesBeam& beam : ping.beams) {
    const Sector sector{beam.tx_tilt_rad, beam.tx_delay_s, beam.tx_array};
    const auto found = std::find(sectors.list.begin(), sectors.list.end(), sector);
    sectors.of_beam.push_back(static_cast<std::uint8_t>(found - sectors.list.begin()));
    if (found == sectors.list.end()) sectors.list.push_back(sector);
    if (sectors.list.size() > 255) throw std::invalid_argument("#MRZ: more than 255 sectors");
  }
  return sectors;
}

void WriteSector(const Sector& sector, std::uint8_t number, std::size_t size, ByteWriter* out) {
  out->Le(number);
  out->Zeros(1);
  out->Le(sector.sub_array);
  out->Zeros(1);
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

bool IsWholeMrz(Bytes datagram) { return ReadMrzLayout(datagram).has_value(); }

std::optional<MbesPing> DecodeMrz(Bytes datagram, int* unusable_beams) {
  const std::optional<MrzLayout> layout = ReadMrzLayout(datagram);
  if (!layout) return std::nullopt;
  MbesPing ping;
  ping.time = ReadKmallHeader(datagram)->time();
  ByteReader common(layout->common);
  common.Skip(2);
  ping.ping_number = common.Le<std::uint16_t>();
  common.Skip(5);
  ping.head = common.Le<std::uint8_t>();  // rxTransducerInd
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

std::optional<PlacedPing> DecodeMrzSoundings(Bytes datagram) {
  const std::optional<MbesPing> raw = DecodeMrz(datagram);
  const std::optional<MrzLayout> layout = ReadMrzLayout(datagram);
  if (!raw || !layout) return std::nullopt;
  PlacedPing ping;
  ping.time = raw->time;
  ping.ping_number = raw->ping_number;
  ping.head = raw->head;
  ByteReader info(layout->ping_info);
  info.Skip(108);
  const double water_line_m = info.Le<float>();
  if (!std::isfinite(water_line_m)) return std::nullopt;
  ping.origin_depth_m = -water_line_m;

  ping.soundings.reserve(raw->beams.size());
  bool any_valid = false;
  for (std::size_t i = 0; i < layout->num_main; ++i) {
    const Bytes sounding = layout->soundings.subspan(i * layout->bytes_per_sounding);
    if (sounding[3] == kExtra) continue;
    ping.soundings.push_back(ReadPlaced(sounding, raw->beams[ping.soundings.size()]));
    any_valid = any_valid || (ping.soundings.back().flags & kBeamValid) != 0;
  }
  return any_valid ? std::optional(std::move(ping)) : std::nullopt;
}

std::optional<NavigationRecord> DecodeMrzNavigation(Bytes datagram) {
  const std::optional<MrzLayout> layout = ReadMrzLayout(datagram);
  if (!layout) return std::nullopt;
  ByteReader info(layout->ping_info);
  info.Skip(96);
  const double heading_deg = info.Le<float>();
  info.Skip(24);
  const double latitude_deg = info.Le<double>();
  const double longitude_deg = info.Le<double>();
  const double height_m = info.Le<float>();
  if (!(std::abs(latitude_deg) <= 90.0) || !(std::abs(longitude_deg) <= 180.0)) return std::nullopt;
  NavigationRecord sample;
  sample.time = ReadKmallHeader(datagram)->time();
  sample.source = "#MRZ";
  sample.position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
  if (std::isfinite(height_m) && height_m != kNoHeight_m) sample.height_m = height_m;
  if (heading_deg >= 0.0 && heading_deg <= 360.0)
    sample.attitude = AttitudeFromDegrees(0.0, 0.0, heading_deg);
  return sample;
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
  WriteKmallHeader(header, ping.time, &out);
  out.Le(std::uint16_t{1});  // parts
  out.Le(std::uint16_t{1});  // this one

  out.Le(static_cast<std::uint16_t>(kCommonBytes));
  out.Le(static_cast<std::uint16_t>(ping.ping_number));
  out.Le(std::uint8_t{1});  // fans of this ping
  out.Zeros(1);
  out.Le(std::uint8_t{1});  // swaths of this ping
  out.Zeros(2);
  out.Le(ping.head);
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

}  // namespace seastitch
