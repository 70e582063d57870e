#pragma once

#include <optional>
#include <variant>

#include "common/core/sensors.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/mbes/kmall.hpp"

namespace seastitch {

struct MbesDecoderParams {
  ClockParams clock;
  KmallReassemblerParams parts;

  std::string Validate() const;
};

using MbesOutput = std::variant<MbesPing, SoundVelocityProfile>;

// Datagrams of a multibeam sonar, as they come from its socket, to pings and profiles.
class MbesDecoder {
 public:
  explicit MbesDecoder(const MbesDecoderParams& params);

  std::optional<MbesOutput> Add(Bytes udp_payload, Time recv, std::uint64_t sender = 0);

  // kmall_malformed, kmall_ignored (other datagram types), kmall_version_unknown,
  // mbes_beam_unusable, mbes_ping_unstamped, and those of the reassembler.
  Counters counters() const;
  Counters clock_figures() const { return stamper_.Figures("mbes"); }

 private:
  MbesDecoderParams params_;
  KmallReassembler reassembler_;
  Stamper stamper_;
  Counters counters_;
};

}  // namespace seastitch
