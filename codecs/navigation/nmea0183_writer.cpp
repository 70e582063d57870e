#include "codecs/navigation/nmea0183_writer.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kKmphPerMps = 3.6;

__attribute__((format(printf, 1, 2))) std::string Format(const char* format, ...) {
  char text[160];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  return text;
}

// "hhmmss.ss" of the instant, cut to hundredths.
std::string TimeOfDay(Time time) {
  const auto since_second = time - std::chrono::floor<std::chrono::seconds>(time);
  return UtcText(time, "%H%M%S") + Format(".%02d", static_cast<int>(since_second.count() / 10'000));
}

// "ddmm.mmmmmm,N": rounded before it is split, so that minutes stay below 60. A unit is 1.9 mm.
std::string Angle(double angle_rad, int degree_digits, const char* letters) {
  constexpr long long kUnitsPerMinute = 1'000'000;
  const long long units = std::llround(std::abs(Rad2Deg(angle_rad)) * 60.0 * kUnitsPerMinute);
  const long long minutes = units / kUnitsPerMinute;
  return Format("%0*lld%02lld.%06lld,%c",
                degree_digits,
                minutes / 60,
                minutes % 60,
                units % kUnitsPerMinute,
                letters[angle_rad < 0.0 ? 1 : 0]);
}

// From 0 to below 360, also after rounding to hundredths.
double Turn(double angle_rad) {
  const long long turned = std::llround(100.0 * Rad2Deg(angle_rad)) % 36'000;
  return static_cast<double>(turned < 0 ? turned + 36'000 : turned) / 100.0;
}

double Sigma(double variance) { return std::sqrt(std::max(0.0, variance)); }

std::string PositionOf(const NmeaState& state) {
  if (!state.position) return ",,,";
  return Angle(state.position->latitude_rad, 2, "NS") + "," +
         Angle(state.position->longitude_rad, 3, "EW");
}

double CourseOf(const NmeaState& state) {
  return Turn(std::atan2(state.v_north_east_mps.y(), state.v_north_east_mps.x()));
}

// Mode indicator of RMC and VTG.
char ModeOf(const NmeaState& state) {
  if (!state.position) return 'N';
  return state.quality == FixQuality::kEstimated ? 'E' : 'A';
}

}  // namespace

std::string NmeaWriter::Sentence(const char* type, const std::string& fields) const {
  const std::string body = talker_ + type + "," + fields;
  return "$" + body + Format("*%02X\r\n", static_cast<unsigned>(NmeaChecksum(body)));
}

std::string NmeaWriter::Gga(const NmeaState& state) const {
  if (!state.position) return Sentence("GGA", TimeOfDay(state.time) + ",,,,,0,00,,,M,,M,,");
  const double sigma_m = Sigma(0.5 * (state.covariance_ned(0, 0) + state.covariance_ned(1, 1)));
  return Sentence("GGA",
                  TimeOfDay(state.time) + "," + PositionOf(state) +
                      Format(",%d,12,%.1f,%.2f,M,,M,,",
                             static_cast<int>(state.quality),
                             std::clamp(sigma_m / kGpsSigmaAtHdop1M, 0.1, 99.9),
                             -state.depth_m));
}

std::string NmeaWriter::Rmc(const NmeaState& state) const {
  return Sentence(
      "RMC",
      TimeOfDay(state.time) + (state.position ? ",A," : ",V,") + PositionOf(state) +
          Format(",%.3f,%.2f,", state.v_north_east_mps.norm() / kMpsPerKnot, CourseOf(state)) +
          UtcText(state.time, "%d%m").append(UtcText(state.time, "%Y").substr(2)) + ",,," +
          ModeOf(state));
}

std::string NmeaWriter::Gst(const NmeaState& state) const {
  if (!state.position) return "";
  const Eigen::Matrix2d horizontal = state.covariance_ned.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> ellipse(horizontal);
  const Eigen::Vector2d major = ellipse.eigenvectors().col(1);
  // An axis has two directions: that of the eastern half.
  const double bearing_rad = std::atan2(major.y(), major.x());
  const double half_turn = bearing_rad < 0.0 ? bearing_rad + kPi : bearing_rad;
  return Sentence("GST",
                  TimeOfDay(state.time) + Format(",,%.3f,%.3f,%.2f,%.3f,%.3f,%.3f",
                                                 Sigma(ellipse.eigenvalues()(1)),
                                                 Sigma(ellipse.eigenvalues()(0)),
                                                 Turn(half_turn),
                                                 Sigma(state.covariance_ned(0, 0)),
                                                 Sigma(state.covariance_ned(1, 1)),
                                                 Sigma(state.covariance_ned(2, 2))));
}

std::string NmeaWriter::Hdt(const NmeaState& state) const {
  return Sentence("HDT", Format("%.2f,T", Turn(state.heading_rad)));
}

std::string NmeaWriter::Vtg(const NmeaState& state) const {
  const Eigen::Vector2d& v = state.v_north_east_mps;
  return Sentence("VTG",
                  Format("%.2f,T,,M,%.3f,N,%.3f,K,%c",
                         CourseOf(state),
                         v.norm() / kMpsPerKnot,
                         v.norm() * kKmphPerMps,
                         ModeOf(state)));
}

std::string NmeaWriter::Dpt(const NmeaState& state) const {
  if (!state.altitude_m) return "";
  return Sentence("DPT", Format("%.2f,%.2f", *state.altitude_m, state.depth_m));
}

std::string NmeaWriter::Zda(const NmeaState& state) const {
  return Sentence("ZDA", TimeOfDay(state.time) + UtcText(state.time, ",%d,%m,%Y,00,00"));
}

}  // namespace seastitch
