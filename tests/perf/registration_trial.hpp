#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/terrain.hpp"
#include "mapper/registration/registration.hpp"
#include "tests/mapper/registration/synthetic_pair.hpp"

// Registrations whose right answer is known: what seastitch-bench-registration counts.
namespace seastitch {

// A piece of seabed to lay pairs on.
struct Site {
  std::shared_ptr<const bench::Terrain> terrain;
  Eigen::Vector2d place{0.0, 0.0};
  std::optional<double> HeightAt(double x, double y) const { return terrain->DepthAt(x, y); }
};

// A kind of seabed; every seed gives another piece of it.
struct SeabedClass {
  std::string name;
  std::function<Site(std::uint64_t seed)> site;
};

// Flat, three degrees of fractal relief, sand waves, a pipeline.
std::vector<SeabedClass> ProceduralClasses();
// Pairs laid at random over the known cells of a raster (see bench::LoadRaster). Throws as that.
SeabedClass RasterClass(const std::string& file);

struct Trial {
  SyntheticPairParams pair;
  double offset_m = 0.0;  // of the prior, in a random direction
  double yaw_rad = 0.0;   // of the prior, to a random side
};

// The prior's sigmas: half of its error, so that the window (3 sigma) reaches half as far again,
// and never below half a metre and half a degree.
Eigen::Matrix3d PriorCovariance(const Trial& trial);
constexpr double kHeightSigmaM = 0.3;  // of the prior

SyntheticPair MakeTrialPair(const Site& site, const Trial& trial, std::uint64_t seed);
Pose2 MakeTrialPrior(const SyntheticPair& pair, const Trial& trial, std::uint64_t seed);

// x, y [m], yaw [rad] of estimate less truth.
Eigen::Vector3d PoseError(const Pose2& estimate, const Pose2& truth);

struct Tolerance {
  double position_m;
  double yaw_rad;
  bool Holds(const Eigen::Vector3d& error) const;
};

struct TrialOutcome {
  RegistrationResult result;
  Eigen::Vector3d error;
  double cpu_s = 0.0;  // preparation of both submaps and registration

  bool Accepted() const { return result.verdict == LoopVerdict::kAccepted; }
  // Error against its own covariance: chi-square of known_directions degrees of freedom.
  double Nees() const { return error.dot(result.information * error); }
  // Accepted, and off by more than one honest result in a million.
  bool ConfidentlyWrong() const { return Accepted() && Nees() > 30.7; }
};

TrialOutcome RunTrial(const SyntheticPair& pair,
                      const Pose2& T_prior,
                      const Eigen::Matrix3d& prior_covariance,
                      const RegistrationParams& params);

// Standard deviation of the heights about a plane where the two submaps overlap [m].
double ReliefOf(const Site& site, const SyntheticPair& pair, const SyntheticPairParams& params);

// What the best method could know of x, y, yaw of T_target_source, pair by pair (sites[i] is that
// of pairs[i]; all of one kind of seabed): inverse of the least covariance, by Cramer and Rao,
// where neither survey knows the seabed, only the mean power S of its waves. Of a known seabed a
// wave k says k^2 S / 2 N about the shift of two surveys with a noise of power N each, of an
// unknown one k^2 S^2 / (N (2 S + N)) (delay of one random signal in two noises: Knapp and Carter,
// 1976). So the true slopes count, wave by wave, for S / (S + N / 2). Heights are unknown but for
// their prior; waves finer than the soundings are apart do not count.
std::vector<Eigen::Matrix3d> FisherInformation(const std::vector<Site>& sites,
                                               const std::vector<SyntheticPair>& pairs,
                                               const SyntheticPairParams& params);

// Chance to end within the tolerance with errors of the least covariance.
double CramerRaoRate(const Eigen::Matrix3d& information, const Tolerance& tolerance);

}  // namespace seastitch
