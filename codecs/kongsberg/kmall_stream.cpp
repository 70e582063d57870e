#include "codecs/kongsberg/kmall_stream.hpp"

#include <algorithm>
#include <stdexcept>

#include "codecs/kongsberg/kmall_sensors.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kWrapBytes = kKmallHeaderBytes + kKmallPartitionBytes + kKmallTailBytes;
constexpr std::size_t kLeastCommonBytes = 12;
constexpr std::size_t kMaxUdpPayload = 65'507;
// From this version on each part repeats the common part, and ping and fan numbers identify a ping.
constexpr std::uint8_t kFirstWithCommonPartRepeated = 3;

bool RepeatsCommonPart(std::uint8_t version) { return version >= kFirstWithCommonPartRepeated; }

// "numBytesCmnPart" of a datagram or part; 0 where it has none.
std::size_t CommonSize(Bytes datagram) {
  ByteReader in(
      datagram.subspan(std::min(datagram.size(), kKmallHeaderBytes + kKmallPartitionBytes)));
  return in.Le<std::uint16_t>();
}

std::vector<std::uint8_t> MakePart(
    Bytes datagram, Bytes common, Bytes slice, std::size_t num_parts, std::size_t number) {
  ByteWriter out;
  out.Append(datagram.first(kKmallHeaderBytes));
  out.Le(static_cast<std::uint16_t>(num_parts));
  out.Le(static_cast<std::uint16_t>(number));
  out.Append(common);
  out.Append(slice);
  return SealKmall(&out);
}

using Parts = std::vector<std::vector<std::uint8_t>>;

// Joins the parts of a datagram; empty if a part is too short.
std::vector<std::uint8_t> Join(const Parts& parts, bool skip_common) {
  ByteWriter out;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Bytes part(parts[i]);
    const std::size_t skipped =
        i == 0 ? 0
               : kKmallHeaderBytes + kKmallPartitionBytes + (skip_common ? CommonSize(part) : 0);
    if (skipped + kKmallTailBytes > part.size()) return {};
    out.Append(part.subspan(skipped, part.size() - skipped - kKmallTailBytes));
  }
  std::vector<std::uint8_t> whole = SealKmall(&out);
  constexpr std::uint8_t kOnePartTheFirst[] = {1, 0, 1, 0};
  std::copy(std::begin(kOnePartTheFirst),
            std::end(kOnePartTheFirst),
            whole.begin() + static_cast<std::ptrdiff_t>(kKmallHeaderBytes));
  return whole;
}

}  // namespace

std::vector<std::vector<std::uint8_t>> SplitIntoParts(Bytes datagram, std::size_t max_bytes) {
  if (max_bytes < 64 || max_bytes > kMaxUdpPayload)
    throw std::invalid_argument("KMALL parts: 64 to 65507 bytes");
  if (datagram.size() <= std::max(max_bytes, kWrapBytes))
    return {std::vector<std::uint8_t>(datagram.begin(), datagram.end())};
  const std::uint8_t version = datagram[8];
  const std::size_t common_size = RepeatsCommonPart(version) ? CommonSize(datagram) : 0;
  const Bytes body =
      datagram.subspan(kKmallHeaderBytes + kKmallPartitionBytes, datagram.size() - kWrapBytes);
  if (common_size >= max_bytes - kWrapBytes || common_size > body.size())
    throw std::invalid_argument("KMALL parts: common part too large");
  // The first part begins with the common part; each further part repeats it.
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

std::optional<std::vector<std::uint8_t>> KmallReassembler::Add(Bytes part, std::uint64_t sender) {
  const std::optional<KmallHeader> header = ReadKmallHeader(part);
  if (!header || !header->Is("#MRZ") || part.size() < kWrapBytes) {
    ++counters_["kmall_part_malformed"];
    return std::nullopt;
  }
  ByteReader in(part);
  in.Skip(kKmallHeaderBytes);
  const std::size_t num_parts = in.Le<std::uint16_t>();
  const std::size_t number = in.Le<std::uint16_t>();
  if (num_parts == 1) return std::vector<std::uint8_t>(part.begin(), part.end());

  const bool repeats_common = RepeatsCommonPart(header->version);
  const std::size_t least =
      kWrapBytes + (repeats_common ? std::max(kLeastCommonBytes, CommonSize(part)) : 0);
  if (num_parts > max_parts_ || number < 1 || number > num_parts || part.size() <= least) {
    ++counters_["kmall_part_malformed"];
    return std::nullopt;
  }
  // One public player writes the size of the whole datagram here, not that of the part.
  if (ByteReader(part.last(kKmallTailBytes)).Le<std::uint32_t>() != part.size())
    ++counters_["kmall_part_tail_wrong"];
  Key key{sender, header->system_id, header->time_s, header->time_ns, 0};
  if (repeats_common)
    key.ping_and_fan = std::uint32_t{part[27]} << 16 | std::uint32_t{part[26]} << 8 | part[29];
  const std::optional<Parts> parts =
      collector_.Add(key, num_parts, number - 1, part, header->time());
  if (!parts) return std::nullopt;
  // The newer rule has one public source only: if the sizes do not fit it, the older rule is tried.
  for (const bool skip_common : {repeats_common, !repeats_common}) {
    std::vector<std::uint8_t> whole = Join(*parts, skip_common);
    if (IsWholeMrz(whole)) return whole;
  }
  ++counters_["kmall_set_inconsistent"];
  return std::nullopt;
}

Counters KmallReassembler::counters() const {
  Counters all = counters_;
  if (collector_.lost() > 0) all["kmall_set_incomplete"] = collector_.lost();
  return all;
}

std::vector<MbesOutput> KmallStream::Add(Bytes payload, Time /*recv*/, std::uint64_t sender) {
  const std::optional<KmallHeader> header = ReadKmallHeader(payload);
  if (!header) {
    ++counters_["kmall_malformed"];
  } else if (header->Is("#MRZ")) {
    if (auto ping = ReadPing(payload, sender)) return {std::move(*ping)};
  } else if (header->Is("#SVP")) {
    if (auto profile = Checked(DecodeSvp(payload))) return {std::move(*profile)};
  } else if (header->Is("#SPO")) {
    if (Checked(DecodeSpo(payload))) ++counters_["kmall_positions"];
  } else if (header->Is("#SKM")) {
    if (const auto motion = Checked(DecodeSkm(payload)))
      counters_["kmall_motion_samples"] += static_cast<std::int64_t>(motion->size());
  } else if (header->Is("#SVT")) {
    if (const auto speeds = Checked(DecodeSvt(payload)))
      counters_["kmall_sound_speeds"] += static_cast<std::int64_t>(speeds->size());
  } else {
    ++counters_["kmall_ignored"];
  }
  return {};
}

std::optional<MbesPing> KmallStream::ReadPing(Bytes part, std::uint64_t sender) {
  if (part[8] > kNewestMrz) {
    ++counters_["kmall_version_unknown"];
    return std::nullopt;
  }
  const std::optional<std::vector<std::uint8_t>> whole = reassembler_.Add(part, sender);
  if (!whole) return std::nullopt;
  int unusable = 0;
  std::optional<MbesPing> ping = Checked(DecodeMrz(*whole, &unusable));
  if (!ping) return std::nullopt;
  if (unusable > 0) counters_["mbes_beam_unusable"] += unusable;
  TurnFromHead(ping->head, head_roll_rad_, &*ping);
  return ping;
}

Counters KmallStream::counters() const {
  Counters all = reassembler_.counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

}  // namespace seastitch
