#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace seastitch {

using Bytes = std::span<const std::uint8_t>;

// The bytes of a text, which must outlive them.
inline Bytes AsBytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Devices and files have IEEE 754 numbers, and the processor must have them, too. Its alignment
// does not matter, because numbers are copied from bytes.
static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);
static_assert(std::endian::native == std::endian::little ||
              std::endian::native == std::endian::big);

namespace detail {
template <class T>
concept WireNumber = std::integral<T> || std::floating_point<T>;
}  // namespace detail

// Bounds-checked cursor over device bytes. After a short read ok() is false, every value is 0 and
// the cursor no longer moves: check ok() once, after the last field.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) : bytes_(bytes) {}

  template <detail::WireNumber T>
  T Le() {
    return Read<T>(std::endian::little);
  }
  template <detail::WireNumber T>
  T Be() {
    return Read<T>(std::endian::big);
  }
  void Skip(std::size_t n) { Take(n); }
  // The next n bytes, or an empty span after a short read.
  Bytes Take(std::size_t n) {
    if (!ok_ || left() < n) {
      ok_ = false;
      return {};
    }
    const Bytes taken = bytes_.subspan(at_, n);
    at_ += n;
    return taken;
  }

  bool ok() const { return ok_; }
  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  template <class T>
  T Read(std::endian order) {
    const Bytes raw = Take(sizeof(T));
    if (raw.empty()) return T{};
    std::array<std::uint8_t, sizeof(T)> number;
    std::copy(raw.begin(), raw.end(), number.begin());
    if (order != std::endian::native) std::reverse(number.begin(), number.end());
    return std::bit_cast<T>(number);
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

// Appends numbers to a growing buffer; the mirror of ByteReader.
class ByteWriter {
 public:
  template <detail::WireNumber T>
  void Le(T value) {
    Write(value, std::endian::little);
  }
  template <detail::WireNumber T>
  void Be(T value) {
    Write(value, std::endian::big);
  }
  void Append(Bytes bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void Reserve(std::size_t n) { bytes_.reserve(n); }
  void Zeros(std::size_t n) { bytes_.resize(bytes_.size() + n); }

  std::size_t size() const { return bytes_.size(); }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  std::vector<std::uint8_t> Release() { return std::move(bytes_); }

 private:
  template <class T>
  void Write(T value, std::endian order) {
    auto raw = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);
    if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }

  std::vector<std::uint8_t> bytes_;
};

}  // namespace seastitch
