#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "codecs/mbes_codec.hpp"

// Teledyne Reson 7k, little-endian, in the network frames that it puts around its records: 7000
// (sonar settings, of which the sound speed) and 7027 (raw detections). A ping needs both.
namespace seastitch {

// What names a ping. Two heads and two swaths may use the same ping number.
struct S7kPingId {
  std::uint32_t device_id = 7125;
  std::uint16_t head = 0;  // "system enumerator"
  std::uint32_t ping_number = 0;
  std::uint16_t multi_ping = 0;
  friend bool operator==(const S7kPingId&, const S7kPingId&) = default;
};

// A record, checked: size, sync pattern and checksum.
struct S7kRecord {
  std::uint32_t type = 0;
  std::uint32_t device_id = 0;
  std::uint16_t head = 0;
  Time time;
  Bytes data;            // type header and record data
  std::size_t size = 0;  // of the whole, from frame to checksum
};
// The record that the bytes begin with.
std::optional<S7kRecord> ReadS7kRecord(Bytes bytes);

struct S7kSettings {
  S7kPingId id;
  double sound_speed_mps = 0.0;
};
std::optional<S7kSettings> DecodeS7k7000(const S7kRecord& record);

// A ping without its sound speed. Beams in the record's order. Valid: found by amplitude or phase,
// and both quality tests passed. *unusable_beams as in DecodeMrz.
struct S7kDetections {
  S7kPingId id;
  MbesPing ping;
};
std::optional<S7kDetections> DecodeS7k7027(const S7kRecord& record, int* unusable_beams = nullptr);

// One tilt for all beams, that of the first; delays are not in this format.
std::vector<std::uint8_t> EncodeS7k7000(const S7kPingId& id, Time time, double sound_speed_mps);
std::vector<std::uint8_t> EncodeS7k7027(const S7kPingId& id, const MbesPing& ping);
// Any record: frame, data, checksum.
std::vector<std::uint8_t> EncodeS7kRecord(std::uint32_t type,
                                          const S7kPingId& id,
                                          Time time,
                                          Bytes data);
// A record in network frames of at most max_bytes each. Throws std::invalid_argument unless
// max_bytes is at least 64 and at most 60000.
std::vector<std::vector<std::uint8_t>> FrameS7k(Bytes record,
                                                std::uint16_t transmission_id,
                                                std::size_t max_bytes = 60'000);

// Pings from their two records, which come one after the other in either order.
class S7kPings {
 public:
  // max_age: of a record whose other half does not come.
  explicit S7kPings(Duration max_age) : max_age_(max_age) {}

  static bool Takes(const S7kRecord& record);
  // Adds a record. Returns the ping that it completes, if any. now: any clock that rises; sender:
  // distinguishes systems that use the same numbers.
  std::optional<MbesPing> Add(const S7kRecord& record, Time now, std::uint64_t sender);
  void GiveUpOld(Time now);
  // s7k_malformed, s7k_ping_without_settings, s7k_ping_without_detections, mbes_beam_unusable.
  const Counters& counters() const { return counters_; }

 private:
  struct HalfPing {
    std::uint64_t sender;
    S7kPingId id;
    Time since;
    std::optional<double> sound_speed_mps;
    std::optional<MbesPing> detections;
  };
  HalfPing* HalfPingOf(const S7kRecord& record, Time now, std::uint64_t sender);
  HalfPing& HalfPingFor(std::uint64_t sender, const S7kPingId& id, Time now);
  void GiveUpFirst();

  Duration max_age_;
  std::deque<HalfPing> half_pings_;  // oldest first
  Counters counters_;
};

class S7kStream : public MbesCodec {
 public:
  explicit S7kStream(const MbesCodecParams& params);

  std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender) override;
  // s7k_malformed (a packet, a frame or a record), s7k_ignored (records of other types),
  // s7k_transmission_incomplete, s7k_ping_without_settings, s7k_ping_without_detections,
  // mbes_beam_unusable.
  Counters counters() const override;

 private:
  struct Transmission {
    std::uint64_t sender;
    std::uint32_t device_id;
    std::uint16_t id;
    std::uint32_t total_bytes;
    friend bool operator==(const Transmission&, const Transmission&) = default;
  };

  std::optional<std::vector<std::uint8_t>> Join(Bytes packet, Time recv, std::uint64_t sender);
  void ReadRecord(const S7kRecord& record,
                  Time recv,
                  std::uint64_t sender,
                  std::vector<MbesOutput>* out);

  std::vector<double> head_roll_rad_;
  std::size_t max_packets_;
  S7kPings pings_;
  PartCollector<Transmission> collector_;
  Counters counters_;
};

}  // namespace seastitch
