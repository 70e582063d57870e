#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/kongsberg/kmall.hpp"
#include "codecs/mbes_codec.hpp"

// KMALL over UDP: one datagram per packet, large #MRZ split into parts.
namespace seastitch {

// Splits a whole #MRZ into parts of at most max_bytes, by the rule of its version. A datagram that
// fits is one part, unchanged. Throws std::invalid_argument unless max_bytes is 64 to 65507.
std::vector<std::vector<std::uint8_t>> SplitIntoParts(Bytes datagram,
                                                      std::size_t max_bytes = 64000);

// Reassembles #MRZ from parts in any order, by the rules of all versions (docs/drivers.md).
class KmallReassembler {
 public:
  explicit KmallReassembler(const PartCollectorParams& params)
      : max_parts_(static_cast<std::size_t>(params.max_parts)), collector_(params) {}

  // Adds a part. Returns the datagram when it is complete; one that is not split at once. sender:
  // distinguishes sonars that use the same ping numbers.
  std::optional<std::vector<std::uint8_t>> Add(Bytes part, std::uint64_t sender = 0);

  // kmall_part_malformed, kmall_part_tail_wrong (the part is used nevertheless),
  // kmall_set_incomplete, kmall_set_inconsistent.
  Counters counters() const;

 private:
  struct Key {
    std::uint64_t sender;
    std::uint8_t system_id;
    std::uint32_t time_s;
    std::uint32_t time_ns;
    std::uint32_t ping_and_fan;  // 0 up to revision H
    friend bool operator==(const Key&, const Key&) = default;
  };

  std::size_t max_parts_;
  PartCollector<Key> collector_;
  Counters counters_;
};

class KmallStream : public MbesCodec {
 public:
  explicit KmallStream(const MbesCodecParams& params)
      : head_roll_rad_(params.head_roll_rad), reassembler_(params.parts) {}

  // Only #MRZ and #SVP give a result.
  std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender) override;
  // Rejected: kmall_malformed, kmall_version_unknown, mbes_beam_unusable and the counters of the
  // reassembler. Read, counted and not used: kmall_positions, kmall_motion_samples,
  // kmall_sound_speeds, and kmall_ignored for every other type.
  Counters counters() const override;

 private:
  std::optional<MbesPing> ReadPing(Bytes part, std::uint64_t sender);
  template <class T>
  std::optional<T> Checked(std::optional<T> decoded) {
    if (!decoded) ++counters_["kmall_malformed"];
    return decoded;
  }

  std::vector<double> head_roll_rad_;
  KmallReassembler reassembler_;
  Counters counters_;
};

}  // namespace seastitch
