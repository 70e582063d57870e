#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

// Records of makers' files that our own writers do not make, or change.
namespace seastitch {

inline void Patch32(std::vector<std::uint8_t>* bytes, std::size_t at, std::int64_t change) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes->data() + at, sizeof value);
  value = static_cast<std::uint32_t>(value + change);
  std::memcpy(bytes->data() + at, &value, sizeof value);
}

// With the serial number of a second receiver, and the checksum anew.
inline std::vector<std::uint8_t> OfSecondHead(std::vector<std::uint8_t> em) {
  ++em[4 + 14];
  const auto sum = std::accumulate(em.begin() + 5, em.end() - 3, 0u);
  em[em.size() - 2] = static_cast<std::uint8_t>(sum);
  em[em.size() - 1] = static_cast<std::uint8_t>(sum >> 8);
  return em;
}

// A position by the receiver's own clock, as its GGA states it.
inline std::vector<std::uint8_t> WithGga(const std::vector<std::uint8_t>& em, Time t) {
  constexpr std::uint8_t kActiveByItsOwnTime = 0xC1;
  const std::string gga = "INGGA," + UtcText(t, "%H%M%S") + ".00,,,,,,,,,";
  constexpr std::ptrdiff_t kDescriptorAt = 4 + 16 + 16;
  std::vector<std::uint8_t> out(em.begin() + 4, em.begin() + kDescriptorAt);
  out.push_back(kActiveByItsOwnTime);
  out.push_back(static_cast<std::uint8_t>(gga.size()));
  out.insert(out.end(), gga.begin(), gga.end());
  if (out.size() % 2 == 0) out.push_back(0);
  const auto sum = std::accumulate(out.begin() + 1, out.end(), 0u);
  ByteWriter whole;
  whole.Le(static_cast<std::uint32_t>(out.size() + 3));
  whole.Append(out);
  whole.Le(std::uint8_t{3});
  whole.Le(static_cast<std::uint16_t>(sum));
  return whole.Release();
}

inline std::vector<std::uint8_t> XtfPacket(std::uint8_t type,
                                           std::uint8_t head,
                                           const ByteWriter& content,
                                           std::size_t padded_to = 64) {
  const std::size_t size = std::max(padded_to, 14 + content.size());
  ByteWriter out;
  out.Le(std::uint16_t{0xFACE});
  out.Le(type);
  out.Le(head);
  out.Zeros(6);
  out.Le(static_cast<std::uint32_t>(size));
  out.Append(content.bytes());
  out.Zeros(size - out.size());
  return out.Release();
}

inline void AddXtfTime(Time t, ByteWriter* out) {
  const auto number = [t](const char* format) { return std::stoi(UtcText(t, format)); };
  out->Le(static_cast<std::uint16_t>(number("%Y")));
  for (const char* const part : {"%m", "%d", "%H", "%M", "%S"})
    out->Le(static_cast<std::uint8_t>(number(part)));
}

inline std::vector<std::uint8_t> GsfRecord(std::uint32_t type, const ByteWriter& data) {
  ByteWriter out;
  const std::size_t padding = (4 - data.size() % 4) % 4;
  out.Be(static_cast<std::uint32_t>(data.size() + padding));
  out.Be(type);
  out.Append(data.bytes());
  out.Zeros(padding);
  return out.Release();
}

}  // namespace seastitch
