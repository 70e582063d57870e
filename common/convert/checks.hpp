#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/checked.hpp"
#include "common/core/pose.hpp"

// Arrays and parts of messages, for FromLcm() and ToLcm(). The limits of values: core/checked.hpp.
namespace seastitch::convert {

constexpr int kMaxParts = 1000;  // of something sent in parts
inline bool ArePlausibleParts(std::int32_t part, std::int32_t num_parts) {
  return num_parts >= 1 && num_parts <= kMaxParts && part >= 0 && part < num_parts;
}

template <class Real>
bool AllFinite(const Real* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    if (!std::isfinite(values[i])) return false;
  return true;
}

// True if the vector has as many elements as the message states, and all are finite.
template <class Real>
bool IsFiniteArray(const std::vector<Real>& values, std::int32_t count) {
  return values.size() == static_cast<std::size_t>(count) &&
         AllFinite(values.data(), values.size());
}

inline Eigen::Quaterniond QuaternionFrom(const double (&wxyz)[4]) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

inline void QuaternionTo(const Eigen::Quaterniond& q, double (&wxyz)[4]) {
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

// Absent unless the quaternion's norm is nearly 1.
inline std::optional<Eigen::Isometry3d> PoseFrom(const double (&p)[3], const double (&wxyz)[4]) {
  const std::optional<Eigen::Quaterniond> q = UnitQuaternion(QuaternionFrom(wxyz));
  if (!q) return std::nullopt;
  return MakePose(Eigen::Map<const Eigen::Vector3d>(p), q->toRotationMatrix());
}

inline void PoseTo(const Eigen::Isometry3d& T, double (&p)[3], double (&wxyz)[4]) {
  Eigen::Map<Eigen::Vector3d>(p, 3) = T.translation();
  QuaternionTo(Eigen::Quaterniond(T.linear()), wxyz);
}

template <int N>
Eigen::Matrix<double, N, N> MatrixFrom(const double (&rows)[N][N]) {
  return Eigen::Map<const Eigen::Matrix<double, N, N, Eigen::RowMajor>>(&rows[0][0]);
}

template <int N>
void MatrixTo(const Eigen::Matrix<double, N, N>& matrix, double (&rows)[N][N]) {
  Eigen::Map<Eigen::Matrix<double, N, N, Eigen::RowMajor>>(&rows[0][0], N, N) = matrix;
}

}  // namespace seastitch::convert
