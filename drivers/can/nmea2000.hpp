#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/health/counters.hpp"
#include "drivers/can/can_frame.hpp"

// NMEA 2000 on extended CAN frames, little-endian: parameter groups ("PGN") of one frame, or of up
// to 223 bytes as a fast packet.
namespace seastitch {

struct N2kMessage {
  std::uint32_t pgn = 0;
  std::uint8_t source = 0;  // address of the device
  std::uint8_t priority = 2;
  std::vector<std::uint8_t> data;
};

// Priority, PGN and source of an extended id; data empty. A PGN below 240 in its third byte is sent
// to one address, which is not part of it.
N2kMessage ReadN2kId(std::uint32_t id);

// The frames of a group that is broadcast: one, or a fast packet of this sequence number (0 to 7).
std::vector<CanFrame> EncodeN2k(const N2kMessage& message, bool fast_packet, int sequence = 0);

// Passes the group from any device at any priority.
CanFilter N2kFilter(std::uint32_t pgn);

// Reassembles fast packets: one at a time for each device and group. Memory: that of one packet
// for each of 256 devices.
class N2kFastPackets {
 public:
  // Adds a frame; returns the group when it was its last. A frame out of its order drops the
  // packet.
  std::optional<N2kMessage> Add(const CanFrame& frame, Time recv);
  // n2k_fast_packet_incomplete, n2k_fast_packet_malformed.
  const Counters& counters() const { return counters_; }

 private:
  struct Packet {
    int sequence = 0;
    std::size_t next_frame = 1;
    std::size_t size = 0;
    Time begun;
    N2kMessage message;
  };
  using Key = std::pair<std::uint8_t, std::uint32_t>;  // source, PGN

  std::optional<N2kMessage> Begin(const N2kMessage& id, Bytes data, Time recv);
  std::optional<N2kMessage> Continue(const Key& key, Bytes data, Time recv);
  std::optional<N2kMessage> DoneOrOpen(const Key& key, Packet packet);

  std::map<Key, Packet> open_;
  Counters counters_;
};

// The next field, in its unit; nothing for the three highest values, which say "not available",
// "out of range" and "reserved".
template <class T>
std::optional<double> ReadN2kField(ByteReader* in, double resolution) {
  const T raw = in->Le<T>();
  if (raw > std::numeric_limits<T>::max() - 3) return std::nullopt;
  return static_cast<double>(raw) * resolution;
}
template <class T>
void WriteN2kField(std::optional<double> value, double resolution, ByteWriter* out) {
  constexpr T kNotAvailable = std::numeric_limits<T>::max();
  if (!value) return out->Le(kNotAvailable);
  const double raw = *value / resolution;
  out->Le(static_cast<T>(raw + (raw < 0.0 ? -0.5 : 0.5)));
}

}  // namespace seastitch
