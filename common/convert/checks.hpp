#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"

// Checks of messages for FromLcm(). NaN fails every check.
namespace seastitch::convert {

constexpr int kMaxParts = 1000;                               // of something sent in parts
constexpr std::int64_t kLatestUtime = 4'102'444'800'000'000;  // 2100-01-01
constexpr double kMaxCoordinate_m = 1e7;                      // larger than any map
constexpr double kQuaternionNormTolerance = 1e-3;
constexpr double kSymmetryTolerance = 1e-6;  // of the largest element

inline bool ArePlausibleParts(std::int32_t part, std::int32_t num_parts) {
  return num_parts >= 1 && num_parts <= kMaxParts && part >= 0 && part < num_parts;
}

inline bool IsTime(std::int64_t utime) { return utime >= 0 && utime < kLatestUtime; }

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

inline bool AreSigmas(const double* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    if (!(values[i] >= 0.0 && std::isfinite(values[i]))) return false;
  return true;
}

inline bool IsPose2(const Pose2& T) {
  return std::abs(T.x) <= kMaxCoordinate_m && std::abs(T.y) <= kMaxCoordinate_m &&
         std::isfinite(T.yaw);
}

// Unit quaternion from w, x, y, z; absent unless its norm is nearly 1.
inline std::optional<Eigen::Quaterniond> QuaternionFrom(const double (&wxyz)[4]) {
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  if (!(std::abs(q.norm() - 1.0) <= kQuaternionNormTolerance)) return std::nullopt;
  return q.normalized();
}

inline void QuaternionTo(const Eigen::Quaterniond& q, double (&wxyz)[4]) {
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

inline std::optional<Eigen::Isometry3d> PoseFrom(const double (&p)[3], const double (&wxyz)[4]) {
  const std::optional<Eigen::Quaterniond> q = QuaternionFrom(wxyz);
  const Eigen::Vector3d position = Eigen::Map<const Eigen::Vector3d>(p);
  if (!q || !(position.cwiseAbs().maxCoeff() <= kMaxCoordinate_m) || !position.allFinite())
    return std::nullopt;
  return MakePose(position, q->toRotationMatrix());
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

// A covariance or information matrix, made exactly symmetric. Absent unless it is finite and
// symmetric, without a negative value on its diagonal.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> SymmetricFrom(const double (&rows)[N][N]) {
  const Eigen::Matrix<double, N, N> m = MatrixFrom<N>(rows);
  if (!m.allFinite() || !(m.diagonal().minCoeff() >= 0.0)) return std::nullopt;
  const double asymmetry = (m - m.transpose()).cwiseAbs().maxCoeff();
  if (!(asymmetry <= kSymmetryTolerance * m.cwiseAbs().maxCoeff())) return std::nullopt;
  return Eigen::Matrix<double, N, N>(0.5 * (m + m.transpose()));
}

}  // namespace seastitch::convert
