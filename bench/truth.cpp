#include "bench/truth.hpp"

#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "common/core/pose.hpp"

namespace seastitch::bench {

void WriteTruth(const SurveySimulator& simulator, const std::filesystem::path& path) {
  constexpr Duration kPeriod{50'000};
  std::ofstream out(path);
  out << "utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg\n";
  for (Duration t{0}; t <= simulator.total(); t += kPeriod) {
    const Eigen::Isometry3d T = simulator.TruthAt(simulator.start() + t).T_map_vehicle;
    const Eigen::Vector3d& p = T.translation();
    const Eigen::Vector3d rpy = RpyFromRotation(T.linear());
    char line[200];
    std::snprintf(line,
                  sizeof line,
                  "%lld,%.4f,%.4f,%.4f,%.5f,%.5f,%.5f\n",
                  static_cast<long long>(ToUtime(simulator.start() + t)),
                  p.x(),
                  p.y(),
                  p.z(),
                  Rad2Deg(rpy.x()),
                  Rad2Deg(rpy.y()),
                  Rad2Deg(rpy.z()));
    out << line;
  }
  out.flush();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written: disk full?");
}

std::filesystem::path TruthPathFor(const std::filesystem::path& log) {
  return log.string() + ".truth.csv";
}

}  // namespace seastitch::bench
