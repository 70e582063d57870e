#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/ids.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

// Serialisation of state that a process saves for its own restart: little endian, field after
// field, without names. The file that contains it has a version; other versions are not read.
//
// A type lists its fields once, for both ways:
//   template <class Archive, class Self>
//   static void Fields(Archive& archive, Self& self) { archive(self.a_, self.b_); }
// or, beside a plain struct, a free function Fields(Archive&, Of<Archive, Struct>&).
namespace seastitch {

class ArchiveWriter;
class ArchiveReader;

// T for an archive that reads, const T for one that writes.
template <class Archive, class T>
using Of = std::conditional_t<std::same_as<Archive, ArchiveReader>, T, const T>;

template <class Archive>
void Fields(Archive& archive, Of<Archive, Pose2>& pose) {
  archive(pose.x, pose.y, pose.yaw);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, NavState>& state) {
  archive(state.time, state.T_map_vehicle, state.v_map_mps, state.covariance, state.bottom_lock);
}

namespace detail {
template <class T, class Archive>
concept HasOwnFields = requires(Archive& archive, T& value) {
  T::Fields(archive, value);
};

template <class T, class Archive>
void ArchiveFields(Archive& archive, T& value) {
  if constexpr (HasOwnFields<T, Archive>)
    std::remove_const_t<T>::Fields(archive, value);
  else
    Fields(archive, value);
}
}  // namespace detail

class ArchiveWriter {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (Write(values), ...);
  }
  std::vector<std::uint8_t> Release() { return bytes_.Release(); }

 private:
  template <detail::WireNumber T>
  void Write(const T& value) {
    if constexpr (std::same_as<T, bool>)
      bytes_.Le<std::uint8_t>(value ? 1 : 0);
    else
      bytes_.Le(value);
  }
  template <class T>
  requires std::is_enum_v<T>
  void Write(const T& value) { Write(static_cast<std::underlying_type_t<T>>(value)); }
  void Write(const Time& t) { Write(ToUtime(t)); }
  void Write(const Duration& d) { Write(std::int64_t{d.count()}); }
  template <class Tag>
  void Write(const Id<Tag>& id) {
    Write(id.value);
  }
  template <class Scalar, int kRows, int kCols>
  void Write(const Eigen::Matrix<Scalar, kRows, kCols>& m) {
    static_assert(kRows > 0 && kCols > 0);
    for (Eigen::Index i = 0; i < m.size(); ++i) Write(m.data()[i]);
  }
  void Write(const Eigen::Quaterniond& q) { Write(Eigen::Vector4d(q.coeffs())); }
  void Write(const Eigen::Isometry3d& T) { Write(Eigen::Matrix4d(T.matrix())); }
  template <class T>
  void Write(const std::optional<T>& value) {
    Write(value.has_value());
    if (value) Write(*value);
  }
  template <class A, class B>
  void Write(const std::pair<A, B>& pair) {
    (*this)(pair.first, pair.second);
  }
  template <class T>
  void Write(const std::vector<T>& values) {
    Write(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) Write(value);
  }
  template <class T>
  void Write(const std::deque<T>& values) {
    Write(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) Write(value);
  }
  template <class... T>
  void Write(const std::variant<T...>& value) {
    Write(static_cast<std::uint8_t>(value.index()));
    std::visit([this](const auto& what) { this->Write(what); }, value);
  }
  template <class T, std::size_t kSize>
  void Write(const std::array<T, kSize>& values) {
    for (const T& value : values) Write(value);
  }
  void Write(const std::string& text) {
    Write(static_cast<std::uint32_t>(text.size()));
    for (const char c : text) Write(static_cast<std::uint8_t>(c));
  }
  template <class T>
  requires std::is_class_v<T>
  void Write(const T& value) { detail::ArchiveFields(*this, value); }

  ByteWriter bytes_;
};

// Reads the bytes of an ArchiveWriter. After a read beyond the end, or of an impossible value, ok()
// is false and later values are meaningless. Memory is bounded by a small multiple of the bytes.
class ArchiveReader {
 public:
  explicit ArchiveReader(Bytes bytes) : bytes_(bytes) {}
  // format: of the file, for types that read an older one too.
  ArchiveReader(Bytes bytes, std::uint32_t format) : bytes_(bytes), format_(format) {}
  std::uint32_t format() const { return format_; }

  template <class... T>
  void operator()(T&... values) {
    (Read(values), ...);
  }
  bool ok() const { return ok_ && bytes_.ok(); }
  // True if all bytes were read.
  bool IsDone() const { return ok() && bytes_.left() == 0; }

 private:
  template <detail::WireNumber T>
  void Read(T& value) {
    if constexpr (std::same_as<T, bool>) {
      const auto byte = bytes_.Le<std::uint8_t>();
      ok_ = ok_ && byte <= 1;
      value = byte == 1;
    } else {
      value = bytes_.Le<T>();
    }
  }
  template <class T>
  requires std::is_enum_v<T>
  void Read(T& value) {
    std::underlying_type_t<T> number{};
    Read(number);
    value = static_cast<T>(number);
  }
  void Read(Time& t) { t = FromUtime(bytes_.Le<std::int64_t>()); }
  void Read(Duration& d) { d = Duration(bytes_.Le<std::int64_t>()); }
  template <class Tag>
  void Read(Id<Tag>& id) {
    Read(id.value);
  }
  template <class Scalar, int kRows, int kCols>
  void Read(Eigen::Matrix<Scalar, kRows, kCols>& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) Read(m.data()[i]);
  }
  void Read(Eigen::Quaterniond& q) {
    Eigen::Vector4d coefficients;
    Read(coefficients);
    q.coeffs() = coefficients;
  }
  void Read(Eigen::Isometry3d& T) {
    Eigen::Matrix4d matrix;
    Read(matrix);
    T.matrix() = matrix;
  }
  template <class T>
  void Read(std::optional<T>& value) {
    bool has_value = false;
    Read(has_value);
    value.reset();
    if (has_value) Read(value.emplace());
  }
  template <class A, class B>
  void Read(std::pair<A, B>& pair) {
    (*this)(pair.first, pair.second);
  }
  template <class T>
  void Read(std::vector<T>& values) {
    ReadList(values);
  }
  template <class T>
  void Read(std::deque<T>& values) {
    ReadList(values);
  }
  template <class... T>
  void Read(std::variant<T...>& value) {
    ReadAlternative(bytes_.Le<std::uint8_t>(), value, std::index_sequence_for<T...>());
  }
  template <class T, std::size_t kSize>
  void Read(std::array<T, kSize>& values) {
    for (T& value : values) Read(value);
  }
  void Read(std::string& text) {
    const Bytes taken = bytes_.Take(bytes_.Le<std::uint32_t>());
    text.assign(taken.begin(), taken.end());
  }
  template <class T>
  requires std::is_class_v<T>
  void Read(T& value) { detail::ArchiveFields(*this, value); }

  template <class List>
  void ReadList(List& values) {
    values.clear();
    const auto size = bytes_.Le<std::uint32_t>();
    // One at a time, so that a damaged size does not allocate more than there are bytes for.
    for (std::uint32_t i = 0; i < size && ok() && bytes_.left() > 0; ++i)
      Read(values.emplace_back());
    ok_ = ok_ && values.size() == size;
  }
  template <class Variant, std::size_t... kIndex>
  void ReadAlternative(std::size_t index, Variant& value, std::index_sequence<kIndex...>) {
    ok_ = ok_ && index < sizeof...(kIndex);
    ((kIndex == index ? Read(value.template emplace<kIndex>()) : void()), ...);
  }

  ByteReader bytes_;
  std::uint32_t format_ = std::numeric_limits<std::uint32_t>::max();
  bool ok_ = true;
};

}  // namespace seastitch
