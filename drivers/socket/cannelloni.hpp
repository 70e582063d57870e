#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/can/can_frame.hpp"

// CAN frames in one UDP datagram: the framing of the open CAN-over-Ethernet gateway cannelloni,
// format version 2, big-endian. Also the payload of RAW_CAN.
namespace seastitch {

struct CannelloniPacket {
  std::uint8_t seq = 0;  // counts packets, wraps
  std::vector<CanFrame> frames;
};

// At most 65535 frames.
std::vector<std::uint8_t> EncodeCannelloni(std::span<const CanFrame> frames, std::uint8_t seq);

// Frames as packets, each of frames that arrived within a millisecond, with the stamp of the last:
// a frame's stamp is wrong by less. seq: of the first packet.
struct StampedPacket {
  std::vector<std::uint8_t> bytes;
  Time recv;
};
std::vector<StampedPacket> PackReceived(std::span<const ReceivedFrame> frames, std::uint8_t seq);

// Nothing for another version or operation, for a frame that runs past the end or cannot exist on
// a bus, and for bytes behind the last frame.
std::optional<CannelloniPacket> DecodeCannelloni(Bytes packet);

}  // namespace seastitch
