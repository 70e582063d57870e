#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"

// Kongsberg KMALL, little-endian, format revisions up to J: #MRZ (one swath of soundings) and #SVP
// (sound velocity profile), and the parts in which large datagrams travel over UDP. Structures
// are stepped over by the sizes that the datagram itself gives.
namespace seastitch {

struct KmallHeader {
  std::uint32_t num_bytes = 0;  // of the datagram or part; encoders set it themselves
  std::array<char, 4> type = {'#', 'M', 'R', 'Z'};
  std::uint8_t version = 3;
  std::uint8_t system_id = 40;
  std::uint16_t echo_sounder_id = 2040;
  std::uint32_t time_s = 0;  // UTC; encoders take it from what they encode
  std::uint32_t time_ns = 0;

  Time time() const;  // to the nearest microsecond
  bool Is(std::string_view name) const { return name == std::string_view(type.data(), 4); }
};

// Nothing unless the bytes begin with a header whose size is that of the bytes.
std::optional<KmallHeader> ReadKmallHeader(Bytes datagram);

// A whole #MRZ of version 0 to 3. Nothing where its sizes do not add up, or where sound speed or
// time make no sense. Beams: main detections in their order, extra detections left out; a
// rejected one has no kBeamValid. A beam that is not finite or not after transmission keeps its
// place as zeros, and is counted in *unusable_beams.
std::optional<MbesPing> DecodeMrz(Bytes datagram, int* unusable_beams = nullptr);
// Beams are grouped into transmit sectors by equal tilt and delay, at most 255 of them. Throws
// std::invalid_argument for more, and for more than 1024 beams.
std::vector<std::uint8_t> EncodeMrz(const MbesPing& ping, const KmallHeader& header);

// A whole #SVP. Samples that are not deeper than the one before are left out. Nothing where a
// value makes no sense or no sample is left.
std::optional<SoundVelocityProfile> DecodeSvp(Bytes datagram);
std::vector<std::uint8_t> EncodeSvp(const SoundVelocityProfile& profile, const KmallHeader& header);

// A whole #MRZ in parts of at most max_bytes, by the rule of its version. One part where it fits,
// byte for byte the datagram. Throws std::invalid_argument unless max_bytes is at least 64 and at
// most 65507.
std::vector<std::vector<std::uint8_t>> SplitIntoParts(Bytes datagram,
                                                      std::size_t max_bytes = 64000);

struct KmallReassemblerParams {
  int max_parts = 32;      // the format's own limit for #MRZ
  int max_open = 4;        // sets being collected: two heads, two swaths
  double max_age_s = 2.0;  // of a set, by the time in the headers that arrive; two slow pings

  std::string Validate() const;
};

// Joins the parts of #MRZ, in any order, with repeats. Memory: max_open * max_parts datagrams.
class KmallReassembler {
 public:
  explicit KmallReassembler(const KmallReassemblerParams& params) : params_(params) {}

  // Gives the whole datagram when this part was its last. `sender` tells systems apart that use
  // the same numbers. A datagram that is not split comes back at once.
  std::optional<std::vector<std::uint8_t>> Add(Bytes part, std::uint64_t sender = 0);

  // kmall_part_malformed, kmall_part_repeated, kmall_part_tail_wrong (used all the same),
  // kmall_set_incomplete, kmall_set_inconsistent.
  const Counters& counters() const { return counters_; }

 private:
  struct Key {
    std::uint64_t sender;
    std::uint8_t system_id;
    std::uint32_t time_s;
    std::uint32_t time_ns;
    std::uint16_t num_parts;
    std::uint32_t ping_and_fan;  // 0 up to revision H
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Set {
    Key key;
    Time time;
    std::vector<std::vector<std::uint8_t>> parts;  // empty: missing
    int received = 0;
    bool done = false;  // kept to know repeats by
  };
  Set& SetFor(const Key& key, Time time);
  void DropOld(Time now);
  std::deque<Set>::iterator Drop(std::deque<Set>::iterator set);
  std::optional<std::vector<std::uint8_t>> Join(const Set& set);

  KmallReassemblerParams params_;
  std::deque<Set> sets_;  // oldest first
  Counters counters_;
};

}  // namespace seastitch
