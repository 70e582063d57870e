#include "drivers/socket/cannelloni.hpp"

#include <chrono>

namespace seastitch {
namespace {

constexpr std::uint8_t kVersion = 2;
constexpr std::uint8_t kData = 0;
constexpr std::uint8_t kFdBit = 0x80;
constexpr std::uint8_t kFdFlags = 0x03;  // bit rate switch, error state
constexpr Duration kMaxPacketSpan = std::chrono::milliseconds(1);

std::optional<CanFrame> ReadFrame(ByteReader* in) {
  CanFrame frame;
  SetIdWord(in->Be<std::uint32_t>(), &frame);
  const auto length = in->Be<std::uint8_t>();
  frame.fd = (length & kFdBit) != 0;
  if (frame.fd) frame.fd_flags = in->Be<std::uint8_t>() & kFdFlags;
  frame.length = length & 0x7F;
  if (frame.length > (frame.fd ? 64 : 8) || (frame.fd && frame.remote)) return std::nullopt;
  if (!frame.remote) frame.SetData(in->Take(frame.length));
  if (!in->ok()) return std::nullopt;
  return frame;
}

}  // namespace

std::vector<std::uint8_t> EncodeCannelloni(std::span<const CanFrame> frames, std::uint8_t seq) {
  ByteWriter out;
  out.Be(kVersion);
  out.Be(kData);
  out.Be(seq);
  out.Be(static_cast<std::uint16_t>(frames.size()));
  for (const CanFrame& frame : frames) {
    out.Be(IdWord(frame));
    out.Be(static_cast<std::uint8_t>(frame.length | (frame.fd ? kFdBit : 0)));
    if (frame.fd) out.Be(frame.fd_flags);
    out.Append(frame.data());
  }
  return out.Release();
}

std::vector<StampedPacket> PackReceived(std::span<const ReceivedFrame> frames, std::uint8_t seq) {
  std::vector<StampedPacket> packets;
  for (std::size_t begin = 0; begin < frames.size();) {
    std::vector<CanFrame> together;
    std::size_t end = begin;
    for (; end < frames.size() &&
           std::chrono::abs(frames[end].recv - frames[begin].recv) <= kMaxPacketSpan;
         ++end)
      together.push_back(frames[end].frame);
    packets.push_back({EncodeCannelloni(together, seq++), frames[end - 1].recv});
    begin = end;
  }
  return packets;
}

std::optional<CannelloniPacket> DecodeCannelloni(Bytes packet) {
  ByteReader in(packet);
  const auto version = in.Be<std::uint8_t>();
  const auto operation = in.Be<std::uint8_t>();
  CannelloniPacket decoded;
  decoded.seq = in.Be<std::uint8_t>();
  const auto count = in.Be<std::uint16_t>();
  if (!in.ok() || version != kVersion || operation != kData) return std::nullopt;
  for (int i = 0; i < count; ++i) {
    const std::optional<CanFrame> frame = ReadFrame(&in);
    if (!frame) return std::nullopt;
    decoded.frames.push_back(*frame);
  }
  if (in.left() != 0) return std::nullopt;
  return decoded;
}

}  // namespace seastitch
