#include "tests/mapper/navigation/fault_dives.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/strapdown.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

namespace seastitch::test {
namespace {

Motion AgileSurvey() {
  Motion motion;
  for (int i = 0; i < 10; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    motion.turns.push_back({40.0 + 57.0 * i, 6.0, side * kPi / 2.0});
    motion.turns.push_back({48.0 + 57.0 * i, 6.0, side * kPi / 2.0});
  }
  return motion;
}

using Row = std::vector<double>;

std::vector<Row> ReadCsvGz(const std::filesystem::path& path) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(
      popen(("gzip -dc '" + path.string() + "'").c_str(), "r"), pclose);
  if (!pipe) throw std::runtime_error("cannot read " + path.string());
  std::string text;
  char buffer[4096];
  while (const std::size_t n = fread(buffer, 1, sizeof buffer, pipe.get())) text.append(buffer, n);
  std::istringstream lines(text);
  std::vector<Row> rows;
  std::string line;
  std::getline(lines, line);  // names
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    Row row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    rows.push_back(std::move(row));
  }
  if (rows.empty()) throw std::runtime_error(path.string() + " is empty");
  return rows;
}

constexpr double kAkitImuHz = 100.0;
constexpr double kAkitDvlDelayS = 1.0;  // of row d to the inertial time d
constexpr double kAkitTruthAheadM = 1.81;
constexpr double kAkitMaxOffsetS = 1.0;
// The attitude that no file holds follows the truth by this part a second.
constexpr double kAkitPullPerS = 0.05;

struct AkitFiles {
  std::vector<Row> imu;
  std::vector<Row> dvl;
  std::vector<Row> truth;

  // Columns 4 to 6: about forward, right, down, with the axes set right.
  Eigen::Vector3d Rate(std::size_t i) const { return {imu[i][4], -imu[i][5], imu[i][6]}; }
  Eigen::Vector3d Force(std::size_t i) const { return {imu[i][1], -imu[i][2], imu[i][3]}; }
  // At a time of the truth's own rows.
  Eigen::Quaterniond Attitude(double row) const {
    const auto q = [this](std::size_t i) {
      return Eigen::Quaterniond(RotationFromRpy(truth[i][7], truth[i][8], truth[i][9]));
    };
    const double at = std::clamp(row, 0.0, static_cast<double>(truth.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(at), truth.size() - 2);
    return q(i).slerp(at - static_cast<double>(i), q(i + 1));
  }
};

// Yaw rate by the gyros and the truth's tilt, summed up from the first sample, where the truth's
// row k belongs to inertial time k + offset_s.
std::vector<double> YawByGyro(const AkitFiles& files, double offset_s) {
  std::vector<double> yaw(files.imu.size() + 1, 0.0);
  for (std::size_t i = 0; i < files.imu.size(); ++i) {
    const double t = static_cast<double>(i) / kAkitImuHz;
    const Eigen::Vector3d rpy = RpyFromRotation(files.Attitude(t - offset_s).toRotationMatrix());
    const Eigen::Vector3d w = files.Rate(i);
    const double rate = (w.y() * std::sin(rpy.x()) + w.z() * std::cos(rpy.x())) / std::cos(rpy.y());
    yaw[i + 1] = yaw[i] + rate / kAkitImuHz;
  }
  return yaw;
}

// By how much the truth's clock is behind the inertial unit's: where the yaw of both agrees best
// from second to second.
double TruthOffset(const AkitFiles& files) {
  double best_s = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (double offset_s = -kAkitMaxOffsetS; offset_s <= kAkitMaxOffsetS; offset_s += 0.01) {
    const std::vector<double> yaw = YawByGyro(files, offset_s);
    const auto yaw_at = [&](double t) {
      return yaw[std::min(static_cast<std::size_t>(std::lround(t * kAkitImuHz)), yaw.size() - 1)];
    };
    double sum = 0.0;
    for (std::size_t k = 1; k + 3 < files.truth.size(); ++k) {
      const double t = static_cast<double>(k) + offset_s;
      const double truth = WrapAngle(files.truth[k + 1][9] - files.truth[k][9]);
      const double off = WrapAngle(truth - (yaw_at(t + 1.0) - yaw_at(t)));
      sum += off * off;
    }
    if (sum < least) {
      least = sum;
      best_s = offset_s;
    }
  }
  return best_s;
}

void AddAkitInertial(const AkitFiles& files, double offset_s, Dive* dive) {
  // From where the truth begins: before, nobody knows what the attitude was.
  const auto first = static_cast<std::size_t>(std::ceil(std::max(offset_s, 0.0) * kAkitImuHz));
  Eigen::Quaterniond device = files.Attitude(static_cast<double>(first) / kAkitImuHz - offset_s);
  for (std::size_t i = first; i < files.imu.size(); ++i) {
    const double t = static_cast<double>(i) / kAkitImuHz;
    ImuSample sample;
    sample.time = At(t);
    sample.angular_rate_radps = files.Rate(i);
    sample.specific_force_mps2 = files.Force(i);
    device = device * QuaternionFromRotationVector(sample.angular_rate_radps / kAkitImuHz);
    device = device.slerp(kAkitPullPerS / kAkitImuHz, files.Attitude(t - offset_s)).normalized();
    sample.attitude.emplace();
    sample.attitude->q_ned_imu = device;
    dive->imu.push_back(sample);
  }
}

void AddAkitTruth(const AkitFiles& files, double offset_s, Dive* dive) {
  dive->vehicle.datum.latitude_rad = files.truth[1][2];
  dive->vehicle.datum.longitude_rad = files.truth[1][1];
  const GeographicLib::LocalCartesian to_map(
      Rad2Deg(dive->vehicle.datum.latitude_rad), Rad2Deg(dive->vehicle.datum.longitude_rad), 0.0);
  for (std::size_t k = 1; k + 1 < files.truth.size(); ++k) {
    const Row& row = files.truth[k];
    double east = 0.0;
    double north = 0.0;
    double up = 0.0;
    to_map.Forward(Rad2Deg(row[2]), Rad2Deg(row[1]), 0.0, east, north, up);
    TruthSample truth;
    truth.time = At(static_cast<double>(k) + offset_s);
    truth.T_map_vehicle = MakePose({north, east, -row[3]}, RotationFromRpy(row[7], row[8], row[9]));
    truth.v_map_mps = {row[4], row[5], row[6]};
    dive->truth.push_back(truth);
    DepthSample depth;
    depth.time = truth.time;
    depth.depth_m = -row[3];
    dive->depth.push_back(depth);
  }
}

// A fibre-optic unit's attitude beside the rates of a vehicle-grade inertial unit, a 1 Hz DVL.
NavigationParams AkitParams() {
  NavigationParams params;
  params.gyro_noise_radps_rthz = 1e-3;
  params.gyro_bias_radps.sigma = 2e-3;
  params.accel_noise_mps2_rthz = 2e-2;
  params.accel_bias_mps2.sigma = 5e-2;
  // Made of the gyros, its heading is off by what their bias adds up to while it follows the truth.
  const double tau_s = 1.0 / kAkitPullPerS;
  params.attitude_roll_pitch_rad = {{Deg2Rad(0.5), Deg2Rad(0.5)}, tau_s};
  params.attitude_heading_rad = {params.gyro_bias_radps.sigma * tau_s, tau_s};
  params.attitude_white_rad.setConstant(Deg2Rad(0.1));
  params.dvl_sigma_mps = 0.03;
  params.dvl_mounting_rad.sigma = Deg2Rad(0.3);
  params.depth_sigma_m = 0.1;
  params.start_sigma_m = 0.1;
  return params;
}

}  // namespace

double DurationS(const Dive& dive) { return ToSeconds(dive.imu.back().time - dive.imu[0].time); }

double DistanceM(const Dive& dive) {
  double distance_m = 0.0;
  for (std::size_t i = 1; i < dive.truth.size(); ++i)
    distance_m +=
        (dive.truth[i].T_map_vehicle.translation() - dive.truth[i - 1].T_map_vehicle.translation())
            .head<2>()
            .norm();
  return distance_m;
}

Dive SimulatedDive(std::uint32_t seed, double duration_s, double imu_hz) {
  Dive dive;
  dive.name = "sim " + std::to_string(seed);
  dive.imu_hz = imu_hz;
  dive.params.start_sigma_m = 0.1;
  dive.vehicle = TestVehicle();
  const std::vector<TruthState> truth = Truth(AgileSurvey(), dive.vehicle, duration_s, imu_hz);
  Sensors sensors(dive.params, imu_hz, seed);
  const auto each = [imu_hz](double hz) { return static_cast<std::size_t>(imu_hz / hz); };
  for (std::size_t i = 0; i < truth.size(); ++i) {
    dive.imu.push_back(sensors.Imu(truth[i]));
    if (i % each(10.0) == 0) dive.depth.push_back(sensors.Depth(truth[i]));
    if (i % each(5.0) == 0) dive.dvl.push_back(sensors.Dvl(truth[i]));
    if (i % each(1.0) == 0)
      dive.truth.push_back({At(truth[i].t), truth[i].T_map_vehicle, truth[i].v_map_mps});
  }
  return dive;
}

std::optional<Dive> AkitDive(const std::filesystem::path& folder, const std::string& run) {
  const std::filesystem::path from = folder / run;
  if (!std::filesystem::exists(from / "imu.csv.gz")) return std::nullopt;
  const AkitFiles files{ReadCsvGz(from / "imu.csv.gz"),
                        ReadCsvGz(from / "dvl.csv.gz"),
                        ReadCsvGz(from / "gt.csv.gz")};
  Dive dive;
  dive.name = run;
  dive.imu_hz = kAkitImuHz;
  dive.params = AkitParams();
  dive.vehicle.T_vehicle_imu.translation().x() = -kAkitTruthAheadM;
  dive.vehicle.T_vehicle_dvl.translation().x() = -kAkitTruthAheadM;
  const double offset_s = TruthOffset(files);
  AddAkitInertial(files, offset_s, &dive);
  AddAkitTruth(files, offset_s, &dive);
  for (std::size_t d = 0; d < files.dvl.size(); ++d) {
    DvlSample sample;
    sample.time = At(static_cast<double>(d) + kAkitDvlDelayS);
    sample.bottom_lock = true;
    sample.v_dvl_mps = {files.dvl[d][1], files.dvl[d][2], files.dvl[d][3]};
    if (sample.time <= dive.imu.back().time) dive.dvl.push_back(sample);
  }
  return dive;
}

}  // namespace seastitch::test
