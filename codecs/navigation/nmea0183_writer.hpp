#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "codecs/navigation/nmea0183.hpp"
#include "common/core/time.hpp"

// Encoders of NMEA 0183 sentences (IEC 61162-1), for programs that take positions from a GNSS
// receiver. Each returns one line with its checksum, carriage return and line feed.
namespace seastitch {

// State of a vehicle, as the sentences state it.
struct NmeaState {
  Time time;
  std::optional<GeoPoint> position;  // absent: not known
  // Covariance of the errors of north, east, down [m^2].
  Eigen::Matrix3d covariance_ned = Eigen::Matrix3d::Zero();
  double depth_m = 0.0;              // of the vehicle, below the water line
  std::optional<double> altitude_m;  // of the vehicle, above the bottom
  Eigen::Vector2d v_north_east_mps = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;  // from true north, clockwise
  FixQuality quality = FixQuality::kEstimated;
};

// Encoder of the sentences of one talker.
class NmeaWriter {
 public:
  // talker: two capital letters, such as "IN" for integrated navigation.
  explicit NmeaWriter(std::string talker) : talker_(std::move(talker)) {}

  // Position; altitude is minus the depth. HDOP is the horizontal sigma (root of the mean of both
  // variances) by kGpsSigmaAtHdop1M, so that a reader that multiplies the two gets the sigma back.
  // The number of satellites is 12, because readers take a position of fewer than four for none.
  // Without a position: quality 0 and empty fields.
  std::string Gga(const NmeaState& state) const;
  // Position, course and speed over ground, date. Status V (void) without a position.
  std::string Rmc(const NmeaState& state) const;
  // 1 sigma [m] of the position: error ellipse, latitude, longitude, altitude. Empty without one.
  std::string Gst(const NmeaState& state) const;
  std::string Hdt(const NmeaState& state) const;
  // Course and speed over ground.
  std::string Vtg(const NmeaState& state) const;
  // Depth of the water below the vehicle, and as its offset the depth of the vehicle: the sum is
  // the depth of the water. Empty without an altitude.
  std::string Dpt(const NmeaState& state) const;
  std::string Zda(const NmeaState& state) const;

 private:
  std::string Sentence(const char* type, const std::string& fields) const;

  std::string talker_;
};

}  // namespace seastitch
