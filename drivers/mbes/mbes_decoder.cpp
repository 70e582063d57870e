#include "drivers/mbes/mbes_decoder.hpp"

namespace seastitch {
namespace {

constexpr std::uint8_t kNewestMrz = 3;

}  // namespace

std::string MbesDecoderParams::Validate() const {
  if (const std::string problem = parts.Validate(); !problem.empty()) return "parts." + problem;
  return clock.Validate();
}

MbesDecoder::MbesDecoder(const MbesDecoderParams& params)
    : params_(params), reassembler_(params.parts) {}

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
  if (params_.clock.clock == DeviceClock::kReceive) ping->time = params_.clock.FromReceive(recv);
  return ping;
}

Counters MbesDecoder::counters() const {
  Counters all = reassembler_.counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

}  // namespace seastitch
