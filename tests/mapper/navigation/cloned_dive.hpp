#pragma once

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"
#include "mapper/navigation/filter/nav_track.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

// The covariance of two poses by a filter that holds a clone of the first: what the relative
// covariance of navigation is compared with.
namespace seastitch {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// --- the models --------------------------------------------------------------------------------

// All that the filter estimates; an error as error_state_filter.hpp defines it.
struct Estimate {
  InertialState imu;
  ErrorVector biases = ErrorVector::Zero();
};

inline Estimate Plus(const Estimate& estimate, const ErrorVector& error) {
  const Eigen::Quaterniond turn = QuaternionFromRotationVector(error.segment<3>(kTilt));
  Estimate truth = estimate;
  truth.imu.p_map += error.segment<3>(kPosition);
  truth.imu.v_map_mps = turn * estimate.imu.v_map_mps + error.segment<3>(kVelocity);
  truth.imu.q_map_imu = turn * estimate.imu.q_map_imu;
  truth.biases.tail<kErrorSize - kGyroBias>() += error.tail<kErrorSize - kGyroBias>();
  return truth;
}

inline ErrorVector Minus(const Estimate& truth, const Estimate& estimate) {
  const Eigen::Quaterniond turn = truth.imu.q_map_imu * estimate.imu.q_map_imu.conjugate();
  ErrorVector error = truth.biases - estimate.biases;
  error.segment<3>(kPosition) = truth.imu.p_map - estimate.imu.p_map;
  error.segment<3>(kVelocity) = truth.imu.v_map_mps - turn * estimate.imu.v_map_mps;
  error.segment<3>(kTilt) = RotationVectorFromQuaternion(turn);
  return error;
}

// d f / d x at x = 0; f gives a vector.
template <class F>
inline MatrixXd Jacobian(const F& f, int size_of_x) {
  constexpr double kStep = 1e-4;
  const auto at = [&](int i, double step) -> VectorXd {
    VectorXd x = VectorXd::Zero(size_of_x);
    x(i) = step;
    return f(x);
  };
  MatrixXd J(at(0, 0.0).size(), size_of_x);
  for (int i = 0; i < size_of_x; ++i) J.col(i) = (at(i, kStep) - at(i, -kStep)) / (2.0 * kStep);
  return J;
}

struct Models {
  NavigationParams params;
  ErrorStateFilter::Mounting mounting;
  EarthModel earth{test::kLatitudeRad};

  // Of each bias: sigma when left alone, and how much of it is left after dt_s.
  ErrorVector BiasSigma() const {
    ErrorVector sigma = ErrorVector::Zero();
    sigma.segment<3>(kGyroBias).setConstant(params.gyro_bias_radps.sigma);
    sigma.segment<3>(kAccelBias).setConstant(params.accel_bias_mps2.sigma);
    sigma(kDvlScale) = params.dvl_scale.sigma;
    sigma.segment<3>(kDvlMounting).setConstant(params.dvl_mounting_rad.sigma);
    sigma.segment<2>(kAttitudeBias) = params.attitude_roll_pitch_rad.sigma;
    sigma(kAttitudeBias + 2) = params.attitude_heading_rad.sigma;
    sigma(kHeadingWander) = params.attitude_heading_wander_rad.sigma;
    sigma.segment<2>(kDeviation).setConstant(params.attitude_deviation_rad);
    sigma(kDepthBias) = params.depth_bias_m.sigma;
    return sigma;
  }
  ErrorVector BiasLeft(double dt_s) const {
    ErrorVector tau_s = ErrorVector::Constant(1e30);  // the deviation stays
    tau_s.segment<3>(kGyroBias).setConstant(params.gyro_bias_radps.tau_s);
    tau_s.segment<3>(kAccelBias).setConstant(params.accel_bias_mps2.tau_s);
    tau_s(kDvlScale) = params.dvl_scale.tau_s;
    tau_s.segment<3>(kDvlMounting).setConstant(params.dvl_mounting_rad.tau_s);
    tau_s.segment<2>(kAttitudeBias).setConstant(params.attitude_roll_pitch_rad.tau_s);
    tau_s(kAttitudeBias + 2) = params.attitude_heading_rad.tau_s;
    tau_s(kHeadingWander) = params.attitude_heading_wander_rad.tau_s;
    tau_s(kDepthBias) = params.depth_bias_m.tau_s;
    return (-dt_s * tau_s.cwiseInverse()).array().exp();
  }

  // What the gyros and accelerometers have measured less their bias and less a noise.
  InertialRates True(const InertialRates& measured,
                     const Estimate& x,
                     const VectorXd& noise) const {
    return {measured.angular_rate_radps - x.biases.segment<3>(kGyroBias) - noise.head<3>(),
            measured.specific_force_mps2 - x.biases.segment<3>(kAccelBias) - noise.tail<3>()};
  }
  Estimate Moved(const Estimate& x,
                 const InertialRates& from,
                 const InertialRates& to,
                 double dt_s,
                 const VectorXd& noise) const {
    Estimate next;
    next.imu = Integrate(x.imu, True(from, x, noise), True(to, x, noise), dt_s, earth);
    next.biases = x.biases.cwiseProduct(BiasLeft(dt_s));
    return next;
  }

  Vector3d Dvl(const Estimate& x, const InertialRates& measured) const {
    const Eigen::Quaterniond q_imu_map = x.imu.q_map_imu.conjugate();
    const Vector3d turn =
        measured.angular_rate_radps - x.biases.segment<3>(kGyroBias) - q_imu_map * earth.rate_radps;
    const Vector3d p_imu_dvl = mounting.T_imu_dvl.translation();
    const Vector3d v_imu = q_imu_map * x.imu.v_map_mps + turn.cross(p_imu_dvl);
    const Eigen::Quaterniond mounted =
        QuaternionFromRotationVector(x.biases.segment<3>(kDvlMounting));
    return (1.0 + x.biases(kDvlScale)) *
           (mounted * (mounting.T_imu_dvl.linear().transpose() * v_imu));
  }
  // Roll, pitch and yaw as the device gives them. Its deviation is that of a given heading: what
  // is lost by taking the estimate's for the true one is a product of two errors.
  Vector3d Attitude(const Estimate& x, double deviation_at_rad) const {
    Vector3d rpy = Rpy(x) + x.biases.segment<3>(kAttitudeBias);
    rpy.z() += x.biases(kHeadingWander) + x.biases(kDeviation) * std::sin(deviation_at_rad) +
               x.biases(kDeviation + 1) * std::cos(deviation_at_rad);
    return rpy;
  }
  static Vector3d Rpy(const Estimate& x) {
    return RpyFromRotation(x.imu.q_map_imu.toRotationMatrix());
  }
  VectorXd Depth(const Estimate& x) const {
    const Vector3d port = x.imu.p_map + x.imu.q_map_imu * mounting.p_imu_depth;
    return VectorXd::Constant(1, port.z() + x.biases(kDepthBias));
  }
  Eigen::Isometry3d Vehicle(const Estimate& x) const {
    return MakePose(x.imu.p_map, x.imu.q_map_imu.toRotationMatrix()) * mounting.T_imu_vehicle;
  }
};

// --- the filter of clones ----------------------------------------------------------------------

// What becomes of clones at an update. Published: the pose was given away at its time and stays, so
// its error is considered (Schmidt) and not corrected. Corrected: every measurement mends the poses
// of the past.
enum class Clones { kPublished, kCorrected };

// Covariance of the error state and, behind it, of x, y, yaw of every clone; and how far each clone
// has been corrected.
class CloningFilter {
 public:
  CloningFilter() = default;
  CloningFilter(const ErrorMatrix& P, Clones clones) : P_(P), clones_(clones) {}

  void Propagate(const MatrixXd& F, const MatrixXd& Q) {
    const int clones = Size() - kErrorSize;
    P_.topLeftCorner<kErrorSize, kErrorSize>() =
        F * P_.topLeftCorner<kErrorSize, kErrorSize>() * F.transpose() + Q;
    P_.topRightCorner(kErrorSize, clones) = F * P_.topRightCorner(kErrorSize, clones);
    P_.bottomLeftCorner(clones, kErrorSize) = P_.topRightCorner(kErrorSize, clones).transpose();
  }
  // Measurement of the present with derivative H by the error state and noise R; `innovation`: less
  // what the estimate expects.
  // Gives the change of the estimated DVL scale.
  double Update(const MatrixXd& H, const MatrixXd& R, const VectorXd& innovation) {
    const MatrixXd PH = P_.leftCols<kErrorSize>() * H.transpose();
    const MatrixXd S = H * PH.topRows<kErrorSize>() + R;
    MatrixXd K = S.llt().solve(PH.transpose()).transpose();
    if (clones_ == Clones::kPublished) K.bottomRows(Size() - kErrorSize).setZero();
    corrections_ += K.bottomRows(Size() - kErrorSize) * innovation;
    // Joseph's form, which holds for any gain.
    MatrixXd rest = MatrixXd::Identity(Size(), Size());
    rest.leftCols<kErrorSize>() -= K * H;
    P_ = (rest * P_ * rest.transpose() + K * R * K.transpose()).eval();
    return K.row(kDvlScale).dot(innovation);
  }
  // After an update that moved the estimate of the DVL's scale by `step` more than its gain does,
  // and all else by its covariance with the scale (docs/navigation.md).
  void MoveScale(double step) {
    corrections_ += P_.col(kDvlScale).tail(Size() - kErrorSize) * (step / P_(kDvlScale, kDvlScale));
  }
  // The pose with derivative J by the error state is kept from now on.
  void Clone(const MatrixXd& J) {
    MatrixXd grow = MatrixXd::Identity(Size() + 3, Size());
    grow.bottomRows<3>().setZero();
    grow.bottomLeftCorner<3, kErrorSize>() = J;
    P_ = (grow * P_ * grow.transpose()).eval();
    corrections_.conservativeResize(corrections_.size() + 3);
    corrections_.tail<3>().setZero();
  }
  // x, y, yaw of every clone in order: what measurements since have added.
  const VectorXd& corrections() const { return corrections_; }
  // Joint covariance of clones a and b, in order of their making.
  Matrix6d CovarianceOf(std::size_t a, std::size_t b) const {
    MatrixXd pick = MatrixXd::Zero(6, Size());
    pick.block<3, 3>(0, kErrorSize + 3 * static_cast<int>(a)).setIdentity();
    pick.block<3, 3>(3, kErrorSize + 3 * static_cast<int>(b)).setIdentity();
    return pick * P_ * pick.transpose();
  }

 private:
  int Size() const { return static_cast<int>(P_.rows()); }

  MatrixXd P_;
  VectorXd corrections_;
  Clones clones_ = Clones::kPublished;
};

inline Pose2 ToPose2(const Vector3d& x_y_yaw) { return {x_y_yaw.x(), x_y_yaw.y(), x_y_yaw.z()}; }

// Of Inverse(a) * b from the joint covariance of both.
inline Eigen::Matrix3d CovarianceOfRelative(const Pose2& a, const Pose2& b, const Matrix6d& joint) {
  const MatrixXd J = Jacobian(
      [&](const VectorXd& x) -> VectorXd {
        const Pose2 a_true = ToPose2(a.Vector() + x.head<3>());
        const Pose2 b_true = ToPose2(b.Vector() + x.tail<3>());
        Vector3d error = (Inverse(a_true) * b_true).Vector() - (Inverse(a) * b).Vector();
        error.z() = WrapAngle(error.z());
        return error;
      },
      6);
  return J * joint * J.transpose();
}

// --- a dive with both --------------------------------------------------------------------------

inline constexpr double kImuHz = 50.0;
inline constexpr double kDurationS = 230.0;

inline NavigationParams Params() {
  NavigationParams params;
  params.start_sigma_m = 3.0;
  params.dvl_scale.sigma = 0.01;  // much to learn, so that correlations change
  params.attitude_heading_wander_rad.sigma = Deg2Rad(0.3);
  params.attitude_deviation_rad = Deg2Rad(0.3);
  params.attitude_time_sigma_s = params.dvl_time_sigma_s = 0.0;  // the models' clocks are right
  params.gate_sigma = 10.0;  // the filter of clones takes every sample
  return params;
}

inline ErrorStateFilter::Mounting Mounting() {
  const VehicleGeometry vehicle = test::TestVehicle();
  ErrorStateFilter::Mounting mounting;
  mounting.T_imu_vehicle = vehicle.T_vehicle_imu.inverse();
  mounting.T_imu_dvl = mounting.T_imu_vehicle * vehicle.T_vehicle_dvl;
  mounting.p_imu_depth = mounting.T_imu_vehicle * vehicle.p_vehicle_depth_m;
  return mounting;
}

// Three legs of 70 s with turns about 35, 58, 105 and 128 s; no bottom lock from 132 to 147 s.
// Clones of the pose are taken at frames_s.
class ClonedDive {
 public:
  explicit ClonedDive(const std::vector<double>& frames_s) : frames_s_(frames_s) {
    test::Motion motion = test::LawnMower(70.0, 3);
    motion.heading_rad = -0.5;  // so that no yaw comes near to half a turn
    const VehicleGeometry vehicle = test::TestVehicle();
    const auto truth = test::Truth(motion, vehicle, kDurationS, kImuHz);
    ErrorStateFilter::Start start;
    start.p_map_imu = (truth[0].T_map_vehicle * vehicle.T_vehicle_imu).translation();
    start.v_map_mps = truth[0].v_map_mps;
    start.sigma_p_m.setConstant(models_.params.start_sigma_m);
    start.sigma_v_mps = 0.1;

    test::Sensors sensors(models_.params, kImuHz, 1);
    ErrorStateFilter filter(models_.params, models_.mounting, models_.earth);
    InertialRates last;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double t = truth[i].t;
      const ImuSample imu = sensors.Imu(truth[i]);
      const InertialRates rates{imu.angular_rate_radps, imu.specific_force_mps2};
      if (i == 0) {
        filter.Initialise(start, imu.attitude->q_ned_imu, Vector3d::Zero());
        published_ = {filter.covariance(), Clones::kPublished};
        corrected_ = {filter.covariance(), Clones::kCorrected};
      } else {
        Propagate(last, rates, &filter);
      }
      last = rates;
      const bool bottom_lock = t < 132.0 || t > 147.0;
      if (i % 20 == 3 && bottom_lock) UseDvl(sensors.Dvl(truth[i]), rates, &filter);
      if (i % 10 == 4) UseDepth(sensors.Depth(truth[i]), &filter);
      if (i % 5 == 0) UseAttitude(*imu.attitude, &filter);
      track_.Add(test::At(t), &filter, bottom_lock);
      if (frames_.size() < frames_s.size() && t > frames_s[frames_.size()] - 1e-6) Clone(filter);
    }
    for (const NavSensor sensor : {NavSensor::kDvl, NavSensor::kDepth, NavSensor::kAttitude})
      EXPECT_EQ(filter.innovations(sensor).gated, 0);
  }

  // Covariance of the pose of frame b in frame a: as the track keeps it, and as clones have it.
  Eigen::Matrix3d Kept(std::size_t a, std::size_t b) const {
    return *track_.RelativeCovariance(test::At(frames_s_[a]), test::At(frames_s_[b]));
  }
  Eigen::Matrix3d Cloned(Clones clones, std::size_t a, std::size_t b) const {
    const CloningFilter& filter = clones == Clones::kPublished ? published_ : corrected_;
    return CovarianceOfRelative(frames_[a], frames_[b], filter.CovarianceOf(a, b));
  }
  // Correction of the pose of frame a by all that was measured until frame b.
  Eigen::Vector3d KeptCorrection(std::size_t a, std::size_t b) const {
    const Pose2 T_anchored_map = *track_.Hindsight(test::At(frames_s_[a]), test::At(frames_s_[b]));
    return (Inverse(T_anchored_map) * frames_[a]).Vector() - frames_[a].Vector();
  }
  const NavTrack& track() const { return track_; }
  Eigen::Vector3d ClonedCorrection(std::size_t a, std::size_t b) const {
    return corrections_at_[b].segment<3>(3 * static_cast<int>(a));
  }

 private:
  static Estimate Of(const ErrorStateFilter& filter) { return {filter.state(), filter.biases()}; }

  void Propagate(const InertialRates& from, const InertialRates& to, ErrorStateFilter* filter) {
    const double dt_s = 1.0 / kImuHz;
    const Estimate x = Of(*filter);
    const Estimate next = models_.Moved(x, from, to, dt_s, VectorXd::Zero(6));
    const MatrixXd F = Jacobian(
        [&](const VectorXd& error) -> VectorXd {
          return Minus(models_.Moved(Plus(x, error), from, to, dt_s, VectorXd::Zero(6)), next);
        },
        kErrorSize);
    const MatrixXd G = Jacobian(
        [&](const VectorXd& noise) -> VectorXd {
          return Minus(models_.Moved(x, from, to, dt_s, noise), next);
        },
        6);
    Vector6d density;
    density << Vector3d::Constant(models_.params.gyro_noise_radps_rthz),
        Vector3d::Constant(models_.params.accel_noise_mps2_rthz);
    MatrixXd Q = G * (density.cwiseAbs2() / dt_s).asDiagonal() * G.transpose();
    Q.diagonal().array() +=
        models_.BiasSigma().array().square() * (1.0 - models_.BiasLeft(dt_s).array().square());
    published_.Propagate(F, Q);
    corrected_.Propagate(F, Q);
    filter->Propagate(from, to, dt_s);
  }

  // `says`: what the sensor would measure, as a vector, where the estimate is the truth; `update`
  // gives the filter its sample.
  template <class Says, class GiveSample>
  void Update(ErrorStateFilter* filter,
              const Says& says,
              const VectorXd& measured,
              const VectorXd& sigma,
              const GiveSample& update) {
    const Estimate x = Of(*filter);
    const MatrixXd H = Jacobian(
        [&](const VectorXd& error) -> VectorXd { return says(Plus(x, error)); }, kErrorSize);
    const MatrixXd R = sigma.cwiseAbs2().asDiagonal();
    const VectorXd innovation = measured - says(x);
    published_.Update(H, R, innovation);
    const double by_gain = corrected_.Update(H, R, innovation);
    update();
    corrected_.MoveScale(filter->biases()(kDvlScale) - x.biases(kDvlScale) - by_gain);
  }
  void UseDvl(const DvlSample& dvl, const InertialRates& rates, ErrorStateFilter* filter) {
    const auto says = [&](const Estimate& x) { return models_.Dvl(x, rates); };
    Update(filter, says, dvl.v_dvl_mps, dvl.sigma_v_mps, [&] {
      filter->UpdateDvl(dvl.v_dvl_mps, dvl.sigma_v_mps);
    });
  }
  void UseDepth(const DepthSample& depth, ErrorStateFilter* filter) {
    const auto says = [&](const Estimate& x) { return models_.Depth(x); };
    const VectorXd measured = VectorXd::Constant(1, depth.depth_m);
    Update(filter, says, measured, VectorXd::Constant(1, depth.sigma_m), [&] {
      filter->UpdateDepth(depth.depth_m, depth.sigma_m);
    });
  }
  void UseAttitude(const Attitude& attitude, ErrorStateFilter* filter) {
    const double yaw = Models::Rpy(Of(*filter)).z();
    const auto says = [&](const Estimate& x) { return models_.Attitude(x, yaw); };
    const Vector3d rpy = RpyFromRotation(attitude.q_ned_imu.toRotationMatrix());
    Update(filter, says, rpy, models_.params.attitude_white_rad, [&] {
      filter->UpdateAttitude(attitude.q_ned_imu, Vector3d::Zero());
    });
  }

  void Clone(const ErrorStateFilter& filter) {
    const Estimate x = Of(filter);
    const auto level = [&](const Estimate& estimate) {
      return LevelPose(models_.Vehicle(estimate));
    };
    const MatrixXd J =
        Jacobian([&](const VectorXd& error) -> VectorXd { return level(Plus(x, error)).Vector(); },
                 kErrorSize);
    published_.Clone(J);
    corrected_.Clone(J);
    frames_.push_back(level(x));
    corrections_at_.push_back(corrected_.corrections());
  }

  const Models models_{Params(), Mounting()};
  const std::vector<double> frames_s_;
  std::vector<Pose2> frames_;
  std::vector<VectorXd> corrections_at_;  // of all frames so far, at each
  NavTrack track_{models_.params};
  CloningFilter published_;
  CloningFilter corrected_;
};

// Variance by `a` over variance by `b`, in the directions where this is least and most.
struct VarianceRatio {
  double least;
  double most;
};
inline VarianceRatio Compare(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      a, b, Eigen::EigenvaluesOnly);
  return {solver.eigenvalues().minCoeff(), solver.eigenvalues().maxCoeff()};
}

// On the whole seconds for which the track keeps the error's transition.
inline const std::vector<double> kWholeSeconds{10.0, 40.0, 67.0, 120.0, 140.0, 160.0, 225.0};
inline const ClonedDive& DiveWithFramesOnWholeSeconds() {
  static const ClonedDive dive(kWholeSeconds);
  return dive;
}

}  // namespace seastitch
