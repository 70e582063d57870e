#include "drivers/can/nmea2000.hpp"

#include <algorithm>
#include <chrono>

namespace seastitch {
namespace {

constexpr std::size_t kFrameBytes = 8;
constexpr std::size_t kFirstBytes = 6;  // data bytes in a fast packet's first frame
constexpr std::size_t kMaxBytes = 223;
constexpr std::uint8_t kUnused = 0xFF;
// A packet of two frames takes one millisecond on the wire.
constexpr Duration kMaxAge = std::chrono::milliseconds(500);

bool IsAddressed(std::uint32_t pgn) { return ((pgn >> 8) & 0xFF) < 240; }

CanFrame MakeFrame(const N2kMessage& message, std::vector<std::uint8_t> data) {
  CanFrame frame;
  frame.extended = true;
  frame.id = std::uint32_t{message.priority} << 26 | message.pgn << 8 | message.source;
  data.resize(kFrameBytes, kUnused);
  frame.SetData(data);
  return frame;
}

}  // namespace

N2kMessage ReadN2kId(std::uint32_t id) {
  N2kMessage message;
  message.priority = static_cast<std::uint8_t>((id >> 26) & 7);
  message.source = static_cast<std::uint8_t>(id & 0xFF);
  message.pgn = (id >> 8) & 0x3FFFF;
  if (IsAddressed(message.pgn)) message.pgn &= 0x3FF00;
  return message;
}

std::vector<CanFrame> EncodeN2k(const N2kMessage& message, bool fast_packet, int sequence) {
  if (!fast_packet) return {MakeFrame(message, message.data)};
  std::vector<CanFrame> frames;
  for (std::size_t at = 0; at == 0 || at < message.data.size();) {
    std::vector<std::uint8_t> data{
        static_cast<std::uint8_t>((static_cast<unsigned>(sequence) & 7U) << 5 | frames.size())};
    if (at == 0) data.push_back(static_cast<std::uint8_t>(message.data.size()));
    const std::size_t n = std::min(kFrameBytes - data.size(), message.data.size() - at);
    const auto begin = message.data.begin() + static_cast<std::ptrdiff_t>(at);
    data.insert(data.end(), begin, begin + static_cast<std::ptrdiff_t>(n));
    frames.push_back(MakeFrame(message, std::move(data)));
    at += std::max<std::size_t>(n, 1);
  }
  return frames;
}

CanFilter N2kFilter(std::uint32_t pgn) {
  return {pgn << 8, true, IsAddressed(pgn) ? 0x03FF0000U : 0x03FFFF00U};
}

std::optional<N2kMessage> N2kFastPackets::Add(const CanFrame& frame, Time recv) {
  const Bytes data = frame.data();
  if (!frame.extended || frame.error || data.size() < 2) {
    ++counters_["n2k_fast_packet_malformed"];
    return std::nullopt;
  }
  const N2kMessage id = ReadN2kId(frame.id);
  return (data[0] & 0x1F) == 0 ? Begin(id, data, recv) : Continue({id.source, id.pgn}, data, recv);
}

std::optional<N2kMessage> N2kFastPackets::Begin(const N2kMessage& id, Bytes data, Time recv) {
  const Key key{id.source, id.pgn};
  if (open_.erase(key) > 0) ++counters_["n2k_fast_packet_incomplete"];
  Packet packet;
  packet.sequence = data[0] >> 5;
  packet.size = data[1];
  packet.begun = recv;
  packet.message = id;
  if (packet.size > kMaxBytes || data.size() < 2 + std::min(packet.size, kFirstBytes)) {
    ++counters_["n2k_fast_packet_malformed"];
    return std::nullopt;
  }
  packet.message.data.assign(data.begin() + 2, data.end());
  return DoneOrOpen(key, std::move(packet));
}

std::optional<N2kMessage> N2kFastPackets::Continue(const Key& key, Bytes data, Time recv) {
  const auto found = open_.find(key);
  if (found == open_.end())
    return std::nullopt;  // counted when its packet was dropped, or its packet began before the
                          // driver listened
  Packet packet = std::move(found->second);
  open_.erase(found);
  const bool next = packet.sequence == data[0] >> 5 && packet.next_frame == (data[0] & 0x1FU) &&
                    std::chrono::abs(recv - packet.begun) <= kMaxAge;
  if (!next) {
    ++counters_["n2k_fast_packet_incomplete"];
    return std::nullopt;
  }
  packet.message.data.insert(packet.message.data.end(), data.begin() + 1, data.end());
  ++packet.next_frame;
  // Only the last frame of a packet may be shorter than 8 bytes.
  const bool full = data.size() == kFrameBytes || packet.message.data.size() >= packet.size;
  if (!full) {
    ++counters_["n2k_fast_packet_malformed"];
    return std::nullopt;
  }
  return DoneOrOpen(key, std::move(packet));
}

std::optional<N2kMessage> N2kFastPackets::DoneOrOpen(const Key& key, Packet packet) {
  if (packet.message.data.size() < packet.size) {
    open_[key] = std::move(packet);
    return std::nullopt;
  }
  packet.message.data.resize(packet.size);
  return std::move(packet.message);
}

}  // namespace seastitch
