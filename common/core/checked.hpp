#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"

// The limits of what the system computes with, in one place a type. FromLcm() holds messages to
// them; samples and results that stay inside a process are held to them where they are made.
//
// Checked() returns a value as a message holds it: unit quaternions, symmetric matrices, not more
// beams than fit one message. It returns std::nullopt where a number is not finite or not within
// its limits; the caller has to count it. NaN fails every check.
namespace seastitch {

// Longer pings are reduced to 1024 evenly spaced beams, first and last included. (The sonar codecs
// reject such pings before.)
constexpr int kMaxBeams = 1024;
constexpr int kMaxSoundings = 2048;  // of a ping in one message
// Longer profiles are reduced to 2000 evenly spaced samples, first and last included.
constexpr int kMaxProfileSamples = 2000;
constexpr int kMaxSubmapPoints = 20'000'000;  // per submap
// Of a footprint with more corners every k-th is kept, with the smallest k that suffices.
constexpr int kMaxFootprintCorners = 3000;
// Longer names are cut to so many bytes.
constexpr std::size_t kMaxProcessName = 64;
constexpr std::size_t kMaxSourceLength = 256;
constexpr std::uint8_t kMaxHead = 127;    // largest index of a sonar's head
constexpr double kMaxCoordinate_m = 1e7;  // larger than any map

std::optional<ImuSample> Checked(ImuSample sample);
std::optional<DvlSample> Checked(DvlSample sample);
std::optional<DepthSample> Checked(DepthSample sample);
std::optional<NavigationSample> Checked(NavigationSample sample);
// Of the covariance of north and east one of the two equal values is used, as in the message.
std::optional<PositionFix> Checked(PositionFix fix);
std::optional<MbesPing> Checked(MbesPing ping);
// Refuses a ping of more than kMaxSoundings: see Split().
std::optional<SoundingPing> Checked(SoundingPing ping);
std::optional<SoundVelocityProfile> Checked(SoundVelocityProfile profile);
std::optional<NavState> Checked(NavState nav);
std::optional<CorrectedNavState> Checked(CorrectedNavState corrected);
std::optional<Submap> Checked(Submap submap);
std::optional<GraphUpdate> Checked(GraphUpdate update);
std::optional<GraphVertex> Checked(GraphVertex vertex);
std::optional<GraphEdge> Checked(GraphEdge edge);
// A malformed update without its malformed edges, or with too many for one message. Absent where
// more is wrong.
std::optional<GraphUpdate> WithoutMalformedEdges(GraphUpdate update);
std::optional<PoseGraph> Checked(PoseGraph graph);
std::optional<CovarianceRequest> Checked(CovarianceRequest request);
std::optional<PairCovariances> Checked(PairCovariances answer);

// A ping as pings of at most kMaxSoundings each, with the same time, number and head. One without
// soundings stays one.
std::vector<SoundingPing> Split(SoundingPing ping);
// At most kMaxBeams of its beams, or kMaxProfileSamples of its samples, evenly spaced.
MbesPing Thinned(MbesPing ping);
SoundVelocityProfile Thinned(SoundVelocityProfile profile);
Footprint Thinned(const Footprint& footprint);

// A pose as a message holds it: its rotation is that of a unit quaternion. Checked() does not do
// this, since what comes from a message has it already.
NavState Quantised(NavState nav);
CorrectedNavState Quantised(CorrectedNavState corrected);
Submap Quantised(Submap submap);

// --- parts of the checks -------------------------------------------------------------------------

constexpr Time kLatestTime = FromUtime(4'102'444'800'000'000);  // 2100-01-01
inline bool IsTime(Time t) { return t >= Time{} && t < kLatestTime; }

inline bool IsSigma(double value) { return value >= 0.0 && std::isfinite(value); }

template <class Derived>
bool AreSigmas(const Eigen::MatrixBase<Derived>& values) {
  return values.allFinite() && (values.array() >= 0.0).all();
}

inline bool IsPose2(const Pose2& T) {
  return std::abs(T.x) <= kMaxCoordinate_m && std::abs(T.y) <= kMaxCoordinate_m &&
         std::isfinite(T.yaw);
}

// The quaternion with norm 1. Absent unless its norm is nearly 1.
std::optional<Eigen::Quaterniond> UnitQuaternion(const Eigen::Quaterniond& q);

// A covariance or information matrix, made exactly symmetric. Absent unless it is finite and
// symmetric, without a negative value on its diagonal.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> Symmetric(const Eigen::Matrix<double, N, N>& m) {
  constexpr double kTolerance = 1e-6;  // of the largest element
  if (!m.allFinite() || !(m.diagonal().minCoeff() >= 0.0)) return std::nullopt;
  const double asymmetry = (m - m.transpose()).cwiseAbs().maxCoeff();
  if (!(asymmetry <= kTolerance * m.cwiseAbs().maxCoeff())) return std::nullopt;
  return Eigen::Matrix<double, N, N>(0.5 * (m + m.transpose()));
}

}  // namespace seastitch
