#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

// Frame of every KMALL datagram: a header at the beginning, and its size again at the end (tail).
namespace seastitch {

inline constexpr std::size_t kKmallHeaderBytes = 20;
inline constexpr std::size_t kKmallPartitionBytes = 4;
inline constexpr std::size_t kKmallTailBytes = 4;

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

// True for the four characters of a datagram's type, such as "#MRZ".
bool IsKmallTypeName(std::string_view name);
// Reads the header. Absent unless its size is that of the bytes.
std::optional<KmallHeader> ReadKmallHeader(Bytes datagram);
// A datagram of that type without its tail; absent where a size is wrong or the time is 0.
std::optional<Bytes> WholeKmall(Bytes datagram, std::string_view type);
// Reads a structure that begins with its own size. all: the bytes that `in` reads from.
Bytes TakeSizedKmall(ByteReader* in, Bytes all, std::size_t least);
// Seconds and nanoseconds, to the nearest microsecond.
Time ReadKmallTime(ByteReader* in);

void WriteKmallHeader(const KmallHeader& header, Time time, ByteWriter* out);
// Appends the tail, and writes the size into it and into the first word.
std::vector<std::uint8_t> SealKmall(ByteWriter* out);

}  // namespace seastitch
