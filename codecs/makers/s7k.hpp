#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "codecs/mbes_codec.hpp"

// Teledyne Reson 7k over UDP, little-endian: records in network frames. A ping needs record 7000
// (sonar settings, which have the sound speed) and record 7027 (raw detections).
namespace seastitch {

// Identity of a ping. Two heads and two swaths may use the same ping number.
struct S7kPingId {
  std::uint32_t device_id = 7125;
  std::uint16_t head = 0;  // "system enumerator"
  std::uint32_t ping_number = 0;
  std::uint16_t multi_ping = 0;
  friend bool operator==(const S7kPingId&, const S7kPingId&) = default;
};

// A record whose size, sync pattern and checksum are right.
struct S7kRecord {
  std::uint32_t type = 0;
  std::uint32_t device_id = 0;
  std::uint16_t head = 0;
  Time time;
  Bytes data;            // type header and record data
  std::size_t size = 0;  // of the whole record, from frame to checksum [bytes]
};
// Index of a record's head (MbesPing::head).
std::uint8_t S7kHead(std::uint16_t system_enumerator);
// The record at the beginning of the bytes.
std::optional<S7kRecord> ReadS7kRecord(Bytes bytes);

struct S7kSettings {
  S7kPingId id;
  double sound_speed_mps = 0.0;
};
std::optional<S7kSettings> DecodeS7k7000(const S7kRecord& record);

// Decodes record 7027: a ping without its sound speed. Beams in the record's order. Valid: found by
// amplitude or phase, and both quality tests passed. *unusable_beams: as DecodeMrz().
struct S7kDetections {
  S7kPingId id;
  MbesPing ping;
};
std::optional<S7kDetections> DecodeS7k7027(const S7kRecord& record, int* unusable_beams = nullptr);

// Encodes record 7027. The format has one tilt for all beams, here that of the first, and no
// transmit delays.
std::vector<std::uint8_t> EncodeS7k7000(const S7kPingId& id, Time time, double sound_speed_mps);
std::vector<std::uint8_t> EncodeS7k7027(const S7kPingId& id, const MbesPing& ping);
// Encodes any record: frame, data, checksum.
std::vector<std::uint8_t> EncodeS7kRecord(std::uint32_t type,
                                          const S7kPingId& id,
                                          Time time,
                                          Bytes data);
// Splits a record into network frames of at most max_bytes each. Throws std::invalid_argument
// unless max_bytes is 64 to 60000.
std::vector<std::vector<std::uint8_t>> FrameS7k(Bytes record,
                                                std::uint16_t transmission_id,
                                                std::size_t max_bytes = 60'000);

// Joins the two records of a ping, which come in either order.
class S7kPings {
 public:
  // max_age: how long a record waits for the other one.
  explicit S7kPings(Duration max_age) : max_age_(max_age) {}

  static bool Takes(const S7kRecord& record);
  // Adds a record. Returns the ping that it completes, if any. now: any clock that never goes back.
  // sender: distinguishes sonars that use the same ping numbers.
  std::optional<MbesPing> Add(const S7kRecord& record, Time now, std::uint64_t sender);
  void GiveUpOld(Time now);
  // Removes and returns the pings that were given up without settings, the last eight at most,
  // while no ping has had settings of its own: with the sound speed of the last settings of any
  // device; 0 if there were none.
  std::deque<MbesPing> TakeWithoutSettings() { return std::exchange(without_settings_, {}); }
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
  std::deque<MbesPing> without_settings_;
  double last_speed_mps_ = 0.0;
  bool any_joined_ = false;
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
