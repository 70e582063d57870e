#include "drivers/mbes/kmall.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kHeaderBytes = 20;
constexpr std::size_t kPartitionBytes = 4;
constexpr std::size_t kTailBytes = 4;
constexpr std::size_t kWrapBytes = kHeaderBytes + kPartitionBytes + kTailBytes;
constexpr std::size_t kMaxUdpPayload = 65'507;
constexpr std::uint8_t kNewestMrz = 3;
// From this version on each part repeats the common part, and ping and fan belong to the key.
constexpr std::uint8_t kFirstWithCommonPartRepeated = 3;

constexpr std::size_t kMaxMainBeams = 1024;
constexpr std::size_t kMaxExtraDetections = 1024;
constexpr std::size_t kMaxProfileSamples = 2000;

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

enum DetectionType : std::uint8_t { kNormal = 0, kExtra = 1, kRejected = 2 };
enum DetectionMethod : std::uint8_t { kNoMethod = 0, kAmplitude = 1, kPhase = 2 };

struct Sector {
  float tilt_rad = 0.0f;
  float delay_s = 0.0f;
};

std::uint32_t LastWord(Bytes datagram) {
  return ByteReader(datagram.last(kTailBytes)).Le<std::uint32_t>();
}

void PutWord(std::uint32_t value, std::size_t at, std::vector<std::uint8_t>* bytes) {
  for (std::size_t i = 0; i < 4; ++i)
    (*bytes)[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
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

bool IsFinite(const MbesBeam& b) {
  return std::isfinite(b.twtt_s) && std::isfinite(b.rx_angle_rad) && std::isfinite(b.tx_tilt_rad) &&
         std::isfinite(b.tx_delay_s) && std::isfinite(b.depth_sigma_ratio) &&
         std::isfinite(b.backscatter_db);
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
  const bool usable = IsFinite(beam) && std::abs(beam.rx_angle_rad) < kPi && beam.twtt_s >= 0.0f &&
                      (beam.twtt_s > 0.0f || (beam.flags & kBeamValid) == 0);
  return {type, usable ? std::optional(beam) : std::nullopt};
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

std::vector<std::uint8_t> Sealed(ByteWriter* out) {
  out->Le(std::uint32_t{0});
  std::vector<std::uint8_t> bytes = out->Release();
  const auto size = static_cast<std::uint32_t>(bytes.size());
  PutWord(size, 0, &bytes);
  PutWord(size, bytes.size() - kTailBytes, &bytes);
  return bytes;
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

bool RepeatsCommonPart(std::uint8_t version) { return version >= kFirstWithCommonPartRepeated; }

// "numBytesCmnPart" of a datagram or part; 0 where it has none.
std::size_t CommonSize(Bytes datagram) {
  ByteReader in(datagram.subspan(std::min(datagram.size(), kHeaderBytes + kPartitionBytes)));
  return in.Le<std::uint16_t>();
}

std::vector<std::uint8_t> MakePart(
    Bytes datagram, Bytes common, Bytes slice, std::size_t num_parts, std::size_t number) {
  ByteWriter out;
  out.Append(datagram.first(kHeaderBytes));
  out.Le(static_cast<std::uint16_t>(num_parts));
  out.Le(static_cast<std::uint16_t>(number));
  out.Append(common);
  out.Append(slice);
  return Sealed(&out);
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
  return Sealed(&out);
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
  return Sealed(&out);
}

std::vector<std::vector<std::uint8_t>> SplitIntoParts(Bytes datagram, std::size_t max_bytes) {
  if (max_bytes < 64 || max_bytes > kMaxUdpPayload)
    throw std::invalid_argument("KMALL parts: 64 to 65507 bytes");
  if (datagram.size() <= std::max(max_bytes, kWrapBytes))
    return {std::vector<std::uint8_t>(datagram.begin(), datagram.end())};
  const std::uint8_t version = datagram[8];
  const std::size_t common_size = RepeatsCommonPart(version) ? CommonSize(datagram) : 0;
  const Bytes body = datagram.subspan(kHeaderBytes + kPartitionBytes, datagram.size() - kWrapBytes);
  if (common_size >= max_bytes - kWrapBytes || common_size > body.size())
    throw std::invalid_argument("KMALL parts: common part too large");
  // The first part's common part is its own beginning; each further one repeats it.
  const Bytes common = body.first(common_size);
  const Bytes rest = body.subspan(common_size);
  const std::size_t slice_bytes = max_bytes - kWrapBytes - common_size;
  const std::size_t num_parts = (rest.size() + slice_bytes - 1) / slice_bytes;
  std::vector<std::vector<std::uint8_t>> parts;
  for (std::size_t i = 0; i < num_parts; ++i) {
    const std::size_t begin = i * slice_bytes;
    const Bytes slice = rest.subspan(begin, std::min(slice_bytes, rest.size() - begin));
    parts.push_back(MakePart(datagram, common, slice, num_parts, i + 1));
  }
  return parts;
}

std::string KmallReassemblerParams::Validate() const {
  if (max_parts < 1 || max_parts > 64) return "max_parts must be 1 to 64";
  if (max_open < 1 || max_open > 16) return "max_open must be 1 to 16";
  if (!(max_age_s > 0.0 && max_age_s <= 60.0)) return "max_age_s must be above 0, at most 60";
  return "";
}

std::optional<std::vector<std::uint8_t>> KmallReassembler::Add(Bytes part, std::uint64_t sender) {
  const std::optional<KmallHeader> header = ReadKmallHeader(part);
  if (!header || !header->Is("#MRZ") || part.size() < kWrapBytes) {
    ++counters_["kmall_part_malformed"];
    return std::nullopt;
  }
  ByteReader in(part);
  in.Skip(kHeaderBytes);
  const auto num_parts = in.Le<std::uint16_t>();
  const auto number = in.Le<std::uint16_t>();
  if (num_parts == 1) return std::vector<std::uint8_t>(part.begin(), part.end());

  const bool repeats_common = RepeatsCommonPart(header->version);
  const std::size_t least =
      kWrapBytes + (repeats_common ? std::max(kCommonBytes, CommonSize(part)) : 0);
  if (num_parts > params_.max_parts || number < 1 || number > num_parts || part.size() <= least) {
    ++counters_["kmall_part_malformed"];
    return std::nullopt;
  }
  // One public player writes the size of the whole datagram here.
  if (LastWord(part) != part.size()) ++counters_["kmall_part_tail_wrong"];
  Key key{sender, header->system_id, header->time_s, header->time_ns, num_parts, 0};
  if (repeats_common)
    key.ping_and_fan = std::uint32_t{part[27]} << 16 | std::uint32_t{part[26]} << 8 | part[29];

  Set& set = SetFor(key, header->time());
  std::vector<std::uint8_t>& slot = set.parts[number - 1U];
  if (set.done || !slot.empty()) {
    ++counters_["kmall_part_repeated"];
    return std::nullopt;
  }
  slot.assign(part.begin(), part.end());
  if (++set.received < num_parts) return std::nullopt;
  set.done = true;
  std::optional<std::vector<std::uint8_t>> whole = Join(set);
  for (std::vector<std::uint8_t>& used : set.parts) used = {};
  if (!whole) ++counters_["kmall_set_inconsistent"];
  return whole;
}

KmallReassembler::Set& KmallReassembler::SetFor(const Key& key, Time time) {
  for (Set& set : sets_)
    if (set.key == key) return set;
  DropOld(time);
  Set& set = sets_.emplace_back();
  set.key = key;
  set.time = time;
  set.parts.resize(key.num_parts);
  return set;
}

void KmallReassembler::DropOld(Time now) {
  const Duration max_age = FromSeconds(params_.max_age_s);
  for (auto set = sets_.begin(); set != sets_.end();)
    set = now - set->time > max_age ? Drop(set) : std::next(set);
  while (sets_.size() >= static_cast<std::size_t>(params_.max_open)) Drop(sets_.begin());
}

std::deque<KmallReassembler::Set>::iterator KmallReassembler::Drop(std::deque<Set>::iterator set) {
  if (!set->done) ++counters_["kmall_set_incomplete"];
  return sets_.erase(set);
}

std::optional<std::vector<std::uint8_t>> KmallReassembler::Join(const Set& set) {
  const auto join = [&set](bool skip_common) {
    ByteWriter out;
    for (std::size_t i = 0; i < set.parts.size(); ++i) {
      const Bytes part(set.parts[i]);
      const std::size_t skipped =
          i == 0 ? 0 : kHeaderBytes + kPartitionBytes + (skip_common ? CommonSize(part) : 0);
      if (skipped + kTailBytes > part.size()) return std::vector<std::uint8_t>();
      out.Append(part.subspan(skipped, part.size() - skipped - kTailBytes));
    }
    std::vector<std::uint8_t> whole = Sealed(&out);
    // One part, the first.
    PutWord(1U | 1U << 16U, kHeaderBytes, &whole);
    return whole;
  };
  const bool by_version = RepeatsCommonPart(set.parts.front()[8]);
  // The newer rule rests on one public source: where it does not add up, the older one is tried.
  for (const bool skip_common : {by_version, !by_version}) {
    std::vector<std::uint8_t> whole = join(skip_common);
    if (!whole.empty() && ReadMrzLayout(whole)) return whole;
  }
  return std::nullopt;
}

}  // namespace seastitch
