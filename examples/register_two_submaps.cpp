// Registers two submaps by their seabed alone. Prints the pose of the second in the first's frame
// and its covariance.
//
//   register_two_submaps TARGET.pcd SOURCE.pcd [SIGMA_M SIGMA_DEG]
//
// The prior is the pose in the files' VIEWPOINT, known to SIGMA_M and SIGMA_DEG (2 m and 2
// degrees).

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "common/storage/submap_file.hpp"
#include "mapper/registration/registration.hpp"

using namespace seastitch;

RegistrationSubmap Prepare(const SubmapPcd& file) {
  return RegistrationSubmap::Prepare(file.cloud, LevelFromBody(file.T_map_submap), {});
}

int main(int argc, char** argv) try {
  if (argc != 3 && argc != 5)
    return std::fprintf(stderr, "register_two_submaps TARGET SOURCE [SIGMA_M SIGMA_DEG]\n"), 64;
  const double sigma_m = argc == 5 ? std::atof(argv[3]) : 2.0;
  const double sigma_rad = Deg2Rad(argc == 5 ? std::atof(argv[4]) : 2.0);
  const SubmapPcd target = ReadSubmapPcd(argv[1]);
  const SubmapPcd source = ReadSubmapPcd(argv[2]);

  RegistrationPrior prior;
  prior.T_target_source = Inverse(LevelPose(target.T_map_submap)) * LevelPose(source.T_map_submap);
  prior.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad;
  prior.z_m = source.T_map_submap.translation().z() - target.T_map_submap.translation().z();
  const RegistrationResult result = Align(Prepare(target), Prepare(source), prior);

  std::printf("%s, overlap %.0f m2\n", ToString(result.verdict), result.overlap_m2);
  if (result.verdict != LoopVerdict::kAccepted) return 1;
  const Pose2& T = result.T_target_source;
  std::printf("x %.3f m, y %.3f m, yaw %.3f deg\n", T.x, T.y, Rad2Deg(T.yaw));
  if (result.known_directions < 3) {
    std::printf("%d of 3 directions are known\n", result.known_directions);
    return 0;
  }
  const Eigen::Matrix3d C = result.information.inverse();
  std::printf("covariance [m, m, rad]\n");
  for (int i = 0; i < 3; ++i) std::printf("%12.3e %12.3e %12.3e\n", C(i, 0), C(i, 1), C(i, 2));
} catch (const std::exception& e) {
  return std::fprintf(stderr, "register_two_submaps: %s\n", e.what()), 1;
}
