#include "drivers/mbes/mbes_decoder.hpp"

#include <algorithm>

namespace seastitch {
namespace {

constexpr std::uint8_t kNewestMrz = 3;

// How long after the ping's time its last echo came: no sonar can tell sooner.
Duration LastEcho(const MbesPing& ping) {
  double last_s = 0.0;
  for (const MbesBeam& beam : ping.beams)
    last_s = std::max(last_s, static_cast<double>(beam.tx_delay_s) + beam.twtt_s);
  return FromSeconds(std::min(last_s, 30.0));  // the range of no sonar: the floats are foreign
}

}  // namespace

std::string MbesDecoderParams::Validate() const {
  if (const std::string problem = parts.Validate(); !problem.empty()) return "parts." + problem;
  return clock.Validate();
}

MbesDecoder::MbesDecoder(const MbesDecoderParams& params)
    : params_(params), reassembler_(params.parts), stamper_(params.clock) {}

std::optional<MbesOutput> MbesDecoder::Add(Bytes udp_payload, Time recv, std::uint64_t sender) {
  const std::optional<KmallHeader> header = ReadKmallHeader(udp_payload);
  if (!header) {
    ++counters_["kmall_malformed"];
    return std::nullopt;
  }
  if (header->Is("#SVP")) {
    std::optional<SoundVelocityProfile> profile = DecodeSvp(udp_payload);
    if (!profile) ++counters_["kmall_malformed"];
    return profile;
  }
  if (!header->Is("#MRZ")) {
    ++counters_["kmall_ignored"];
    return std::nullopt;
  }
  if (header->version > kNewestMrz) {
    ++counters_["kmall_version_unknown"];
    return std::nullopt;
  }
  const std::optional<std::vector<std::uint8_t>> whole = reassembler_.Add(udp_payload, sender);
  if (!whole) return std::nullopt;
  int unusable = 0;
  std::optional<MbesPing> ping = DecodeMrz(*whole, &unusable);
  if (!ping) {
    ++counters_["kmall_malformed"];
    return std::nullopt;
  }
  if (unusable > 0) counters_["mbes_beam_unusable"] += unusable;
  const std::optional<Time> time = stamper_.Stamp(ping->time, recv, LastEcho(*ping));
  if (!time) {
    ++counters_["mbes_ping_unstamped"];
    return std::nullopt;
  }
  ping->time = *time;
  return ping;
}

Counters MbesDecoder::counters() const {
  Counters all = reassembler_.counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

}  // namespace seastitch
