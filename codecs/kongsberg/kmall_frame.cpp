#include "codecs/kongsberg/kmall_frame.hpp"

#include <algorithm>

namespace seastitch {
namespace {

constexpr std::size_t kHeaderBytes = kKmallHeaderBytes;
constexpr std::size_t kTailBytes = kKmallTailBytes;

std::uint32_t LastWord(Bytes datagram) {
  return ByteReader(datagram.last(kTailBytes)).Le<std::uint32_t>();
}

}  // namespace

Time KmallHeader::time() const {
  return FromUtime(static_cast<std::int64_t>(time_s) * 1'000'000 +
                   (static_cast<std::int64_t>(time_ns) + 500) / 1000);
}

bool IsKmallTypeName(std::string_view name) {
  return name.size() == 4 && name[0] == '#' &&
         std::all_of(name.begin() + 1, name.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
}

std::optional<KmallHeader> ReadKmallHeader(Bytes datagram) {
  if (datagram.size() < kHeaderBytes + kTailBytes) return std::nullopt;
  ByteReader in(datagram);
  KmallHeader header;
  header.num_bytes = in.Le<std::uint32_t>();
  for (char& c : header.type) c = static_cast<char>(in.Le<std::uint8_t>());
  header.version = in.Le<std::uint8_t>();
  header.system_id = in.Le<std::uint8_t>();
  header.echo_sounder_id = in.Le<std::uint16_t>();
  header.time_s = in.Le<std::uint32_t>();
  header.time_ns = in.Le<std::uint32_t>();
  const bool usable = header.type[0] == '#' && header.num_bytes == datagram.size() &&
                      header.time_ns < 1'000'000'000;
  return usable ? std::optional(header) : std::nullopt;
}

std::optional<Bytes> WholeKmall(Bytes datagram, std::string_view type) {
  const std::optional<KmallHeader> header = ReadKmallHeader(datagram);
  if (!header || !header->Is(type) || header->time_s == 0) return std::nullopt;
  if (LastWord(datagram) != datagram.size()) return std::nullopt;
  return datagram.subspan(0, datagram.size() - kTailBytes);
}

Bytes TakeSizedKmall(ByteReader* in, Bytes all, std::size_t least) {
  if (in->left() < 2) {
    in->Skip(2);
    return {};
  }
  const std::size_t size = ByteReader(all.subspan(in->at())).Le<std::uint16_t>();
  return size < least ? in->Take(in->left() + 1) : in->Take(size);
}

Time ReadKmallTime(ByteReader* in) {
  const std::int64_t seconds = in->Le<std::uint32_t>();
  const std::int64_t nanoseconds = in->Le<std::uint32_t>();
  return FromUtime(seconds * 1'000'000 + (nanoseconds + 500) / 1000);
}

void WriteKmallHeader(const KmallHeader& header, Time time, ByteWriter* out) {
  out->Le(std::uint32_t{0});  // size, known at the end
  for (const char c : header.type) out->Le(static_cast<std::uint8_t>(c));
  out->Le(header.version);
  out->Le(header.system_id);
  out->Le(header.echo_sounder_id);
  out->Le(static_cast<std::uint32_t>(ToUtime(time) / 1'000'000));
  out->Le(static_cast<std::uint32_t>(ToUtime(time) % 1'000'000 * 1000));
}

std::vector<std::uint8_t> SealKmall(ByteWriter* out) {
  out->Le(std::uint32_t{0});
  std::vector<std::uint8_t> bytes = out->Release();
  for (std::size_t i = 0; i < 4; ++i)
    bytes[i] = bytes[bytes.size() - kTailBytes + i] =
        static_cast<std::uint8_t>(bytes.size() >> (8 * i));
  return bytes;
}

}  // namespace seastitch
