#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "common/core/pose.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/filter/strapdown.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Order of the error state. Map axes are north, east, down; imu and dvl are the axes of the units.
// Truth = estimate + error, with two exceptions. The attitude error is a rotation vector in map
// axes, R_true = Exp(tilt) R_estimate. The velocity error is defined after the estimate is rotated
// by it, v_true = Exp(tilt) v_estimate + error. In this invariant form (Barrau and Bonnabel, IEEE
// Trans. Automatic Control 62(4), 2017) the Jacobian of a DVL measurement has no heading column:
// the filter does not gain spurious information on heading from it. A bias is what the sensor adds:
// measured = true + bias.
enum ErrorIndex : int {
  kPosition = 0,        // m, map
  kVelocity = 3,        // m/s, map
  kTilt = 6,            // rad, map: attitude, all three axes
  kGyroBias = 9,        // rad/s, imu
  kAccelBias = 12,      // m/s2, imu
  kDvlScale = 15,       // measured = (1 + scale) * true
  kDvlMounting = 16,    // rad, dvl: measured = (1 + scale) Exp(mounting) true
  kAttitudeBias = 19,   // rad: slow error of the attitude sensor in roll, pitch, yaw
  kHeadingWander = 22,  // rad: its error in yaw that wanders within minutes (Gauss-Markov)
  kDeviation = 23,      // rad: coefficients of its deviation, B sin(yaw) + C cos(yaw)
  kDepthBias = 25,      // m: bias of the pressure sensor's depth
  // 1 if the other hypothesis of the heading is the right one, else 0: a Bernoulli variable,
  // treated as a Gaussian of variance 1 until it is decided.
  kHeadingDoubt = 26,
  kErrorSize = 27,
};

constexpr int kNavSize = kGyroBias;  // position, velocity, tilt
constexpr int kBiasSize = kErrorSize - kNavSize;

using ErrorVector = Eigen::Matrix<double, kErrorSize, 1>;
using ErrorMatrix = Eigen::Matrix<double, kErrorSize, kErrorSize>;
using ErrorRow = Eigen::Matrix<double, 1, kErrorSize>;
using AttitudeRows = Eigen::Matrix<double, 3, kErrorSize>;

// Motion of a vehicle in a gap of the inertial data, 1 sigma: its angular rate, and the roll and
// pitch that it may have.
constexpr double kCoastTurnRadps = 0.1;
constexpr double kCoastTilt = Deg2Rad(3.0);

// Sensitivity of a DVL velocity to its time stamp.
struct DvlStamping {
  Eigen::Vector3d change_mps2 = Eigen::Vector3d::Zero();  // rate of change, DVL axes
  double carried_s = 0.0;  // how long it was extrapolated to its stamp
};

// Error-state Kalman filter of the inertial unit's motion; the error model is that of Groves,
// Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., 14.2.3,
// for a local-level map fixed to the Earth. Its caller orders the samples, keeps their times and
// rejects bad input: here none of that is checked. "The device" is the sensor of roll, pitch and
// heading (AHRS or INS).
//
// Besides state and covariance it keeps, since the last TakeTransition(), the transition matrix A
// of the error: the product of all (I - K H) and F. For published estimates, which are not
// corrected later, Cov(error(b), error(a)) = A(a to b) Cov(error(a)). It also keeps the adjoint
// vector `adjoint` of the modified Bryson-Frazier smoother (Bierman, Factorization Methods for
// Discrete Sequential Estimation, 1977, ch. X): Cov(error(a)) times `adjoint` at b is the
// correction of the estimate of a by the measurements between a and b (Hindsight).
class ErrorStateFilter {
 public:
  // Poses of the vehicle frame and the DVL in imu axes, and position of the pressure port [m].
  struct Mounting {
    Eigen::Isometry3d T_imu_vehicle = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d T_imu_dvl = Eigen::Isometry3d::Identity();
    Eigen::Vector3d p_imu_depth = Eigen::Vector3d::Zero();
  };
  // Position and velocity of the inertial unit at the start; its attitude comes from the device.
  struct Start {
    Eigen::Vector3d p_map_imu = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
    Eigen::Vector3d sigma_p_m = Eigen::Vector3d::Ones();
    double sigma_v_mps = 1.0;
  };

  ErrorStateFilter(const NavigationParams& params,
                   const Mounting& mounting,
                   const EarthModel& earth);

  // sigma_rpy_rad: 1 sigma that the device states; the larger of it and the one in params is used.
  void Initialise(const Start& start,
                  const Eigen::Quaterniond& q_map_imu,
                  const Eigen::Vector3d& sigma_rpy_rad);

  // Integrates angular rate and specific force as measured, biases included, linear from `from` to
  // `to` over dt_s.
  void Propagate(const InertialRates& from, const InertialRates& to, double dt_s);
  // The same while the accelerometers are in doubt: the velocity in vehicle axes is held constant.
  void PropagateHoldingVelocity(const InertialRates& from, const InertialRates& to, double dt_s);
  // Adds the error of attitude and velocity by rates that were not linear between two samples: 1
  // sigma in imu axes [rad, m/s].
  void AddErrorOfRates(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& push_mps);
  // Bridges a gap in the inertial data by a constant velocity. The attitude afterwards is the
  // device's, or without one that before the gap.
  void Coast(double dt_s,
             const std::optional<Eigen::Quaterniond>& q_map_imu,
             const InertialRates& now);

  // Measurement updates with gates. Each returns the number of components that its gate refused.
  int UpdateAttitude(const Eigen::Quaterniond& q_map_imu, const Eigen::Vector3d& sigma_rpy_rad);
  // An ensemble is used whole, or not at all where a component is refused. kUnchanged: the update
  // leaves DVL scale and mounting as they are, for an ensemble soon after a refusal.
  enum class SlowStates : std::uint8_t { kEstimated, kUnchanged };  // scale and mounting of the DVL
  int UpdateDvl(const Eigen::Vector3d& v_dvl_mps,
                const Eigen::Vector3d& sigma_mps,
                const DvlStamping& stamping = DvlStamping(),
                SlowStates slow = SlowStates::kEstimated);
  int UpdateDepth(double depth_m, double sigma_m);
  int UpdatePosition(const Eigen::Vector2d& north_east_m, const Eigen::Matrix2d& covariance_m2);

  // Resets: the state is set to the measurement, and its error becomes the measurement's. For a
  // state that is known to be wrong, where an update would be refused. Positions are of the vehicle
  // frame.
  void TakeAttitude(const Eigen::Quaterniond& q_map_imu, const Eigen::Vector3d& sigma_rpy_rad);
  void TakeVelocity(const Eigen::Vector3d& v_dvl_mps,
                    const Eigen::Vector3d& sigma_mps,
                    const DvlStamping& stamping = DvlStamping());
  void TakeDepth(double depth_m, double sigma_m);
  void TakePosition(const Eigen::Vector2d& north_east_m, const Eigen::Matrix2d& covariance_m2);
  // Corrects the position for the displacement by a velocity or attitude that was wrong until a
  // reset, and adds to the position's covariance what is uncertain of it. Map axes.
  void MovePosition(const Eigen::Vector3d& by_m);
  void WidenPosition(const Eigen::Matrix3d& by_m2);
  // Resets the covariance of biases to the data sheet's, since a wrong sensor may have corrupted
  // them. Call ReopenAttitudeBias() only with TakeAttitude() right after: without the bias's
  // correlation with the attitude error, the next attitude would count twice.
  void ReopenInertialBiases();
  // False: measurements do not change the biases of the inertial unit, because it is in doubt, nor
  // DVL scale and mounting, which would be estimated from it.
  void EstimateInertialBiases(bool estimate) { estimates_inertial_ = estimate; }
  void ReopenAttitudeBias();
  // Shortens the velocity to limit_mps; its sigma is then the limit at least.
  void LimitSpeed(double limit_mps);

  // Treats a step of the device's heading that the gyros did not measure; step_rad: new minus old,
  // clockwise from above positive. From then on there are two hypotheses: the device is wrong since
  // the step (the state's heading stays), or it was wrong before (the heading follows the step).
  // The state is that of one hypothesis and the covariance about it includes the other, until the
  // device steps back or positions decide.
  void KeepHeadingOverStep(double step_rad);
  void FollowHeadingStep(double step_rad);
  enum class HeadingHypothesis : std::uint8_t { kOwn, kOther };
  // Ends the two hypotheses. kOther: the state moves to the other one.
  void EndHeadingDoubt(HeadingHypothesis right);
  // The device is back where it was.
  void TrustDeviceHeading();
  // By how much the other hypothesis has more heading; 0: there is none.
  double heading_doubt_rad() const { return doubt_rad_; }
  // Error of the state if the other heading hypothesis is true. Propagates the covariance first.
  struct HeadingDoubt {
    int number = 0;  // counts the doubts of a dive; 0: no doubt now
    ErrorVector error = ErrorVector::Zero();
  };
  HeadingDoubt heading_doubt();
  // What the device adds to the heading by steps that the filter did not follow.
  double heading_offset_rad() const { return heading_offset_rad_; }
  // Residuals, measured minus predicted: heading [rad], its 1 sigma, velocity [m/s, dvl axes], and
  // roll, pitch, yaw [rad].
  double HeadingResidual(const Eigen::Quaterniond& q_map_imu) const;
  double HeadingResidualSigma();
  Eigen::Vector3d DvlResidual(const Eigen::Vector3d& v_dvl_mps) const;
  Eigen::Vector3d AttitudeResidual(const Eigen::Quaterniond& q_map_imu) const;

  // 1 sigma of the largest component [rad/s], as of the last propagation of the covariance.
  double GyroBiasSigma() const;
  InertialRates WithoutBias(const InertialRates& measured) const;

  // The vehicle frame, now.
  Eigen::Isometry3d T_map_vehicle() const;
  Eigen::Vector3d v_map_vehicle_mps() const;
  // Jacobian of the vehicle frame's x, y, z [m], roll, pitch, yaw [rad], v north, v east [m/s] with
  // respect to the error state.
  Eigen::Matrix<double, 8, kErrorSize> VehicleJacobian() const;

  const InertialState& state() const { return state_; }
  // Estimated sensor errors in the order of ErrorIndex; zero at the first nine and at
  // kHeadingDoubt.
  const ErrorVector& biases() const { return biases_; }
  // Brings the covariance up to the state, and returns it.
  const ErrorMatrix& covariance();
  struct Transition {
    ErrorMatrix A;
    ErrorVector adjoint;  // sum of A^T H^T innovation / its variance, A up to each measurement

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.A, self.adjoint);
    }
  };
  // Since the last call (or the start).
  Transition TakeTransition();
  const ErrorVector& adjoint() const { return since_.adjoint; }
  // Error of the state caused by late DVL stamps: with a delay of d seconds it is d * by_delay -
  // by_carrying, and is not part of the covariance. A considered parameter (Schmidt-Kalman): the
  // filter does not estimate it.
  struct StampError {
    ErrorVector by_delay = ErrorVector::Zero();     // per second of delay
    ErrorVector by_carrying = ErrorVector::Zero();  // part that extrapolation removed

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.by_delay, self.by_carrying);
    }
  };
  // Propagates it to the time of the state, and returns it.
  const StampError& stamp_error();

  InnovationSummary innovations(NavSensor sensor) const;
  // Number of jumps of the position by resets (MovePosition()), and the sum of their lengths.
  struct Moves {
    std::int64_t count = 0;
    double way_m = 0.0;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.count, self.way_m);
    }
  };
  const Moves& moves() const { return moves_; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.gyro_psd_, self.accel_psd_, self.state_, self.biases_, self.rates_);
    archive(self.P_, self.P0_by_dvl_, self.since_, self.correction_, self.stamp_error_);
    archive(self.bias_sigma_, self.bias_rate_, self.velocity_is_held_, self.estimates_slow_);
    archive(self.estimates_inertial_);
    archive(self.least_attitude_sigma_, self.moves_, self.heading_offset_rad_, self.doubt_rad_);
    archive(self.doubts_);
    archive(self.pending_s_, self.pending_R_, self.pending_move_, self.innovations_);
  }
  bool IsFinite() const;

 private:
  void ReopenBiases(int first, int size);
  void Step(const InertialRates& from, const InertialRates& to, double dt_s);
  Eigen::Vector3d ForceThatHolds(const Eigen::Vector3d& rate_radps) const;
  Eigen::Vector3d TurnOverGround() const;  // angular rate with respect to the Earth [rad/s], imu
  struct DvlModel {
    Eigen::Vector3d expected_mps;
    Eigen::Matrix<double, 3, kErrorSize> H;
  };
  DvlModel ModelDvl() const;
  Eigen::Vector3d DvlSigma(const Eigen::Vector3d& sigma_mps) const;
  void PropagateCovariance();
  // Jacobian of the device's error in roll, pitch, yaw with respect to the error state.
  AttitudeRows DeviceErrorRows() const;
  Eigen::Quaterniond WithoutStep(const Eigen::Quaterniond& q_map_imu) const;
  Eigen::Quaterniond WithoutDeviceError(const Eigen::Quaterniond& q_map_imu) const;
  void AlignWithDevice();
  // Adapts the sigma of an attitude bias to the sigma that the device states now.
  void FollowStatedSigma(int axis, double sigma);
  // Adds an error of heading of lost_rad, 1 sigma, to the wander.
  void LoseHeading(double lost_rad);
  // Reduces the sigma of bias i from `before` to `after`, as a measurement of it would.
  void ShrinkBias(int i, double before, double after);
  void DoubtHeading(double other_rad);
  void RotateDisplacementByHeadingDoubt();
  double StepVariance() const;
  ErrorVector ByHeadingDoubt() const;
  bool DecideHeading(const Eigen::Vector2d& other_m,
                     const Eigen::Vector2d& residual_m,
                     const Eigen::Matrix2d& S);
  void Apply(const ErrorMatrix& M);
  void SetAttitudeBiasSigma(const Eigen::Vector3d& sigma_rpy_rad);
  // Offers the scalar `residual` = H error + noise, one of the sensor's up to three components.
  // change_per_s, carried_s: DvlStamping. False: beyond the gate.
  bool Offer(NavSensor sensor,
             int component,
             const ErrorRow& H,
             double residual,
             double variance,
             double change_per_s = 0.0,
             double carried_s = 0.0);
  // The same without a gate: for components that pass it together.
  void Use(NavSensor sensor,
           int component,
           const ErrorRow& H,
           double residual,
           double variance,
           double change_per_s = 0.0,
           double carried_s = 0.0);
  // Before the update by such a scalar, with PH = P_ H^T: takes from the correction the bias
  // that correlated noise would cause in the DVL's scale.
  double TakeNoiseOffScale(NavSensor sensor,
                           const ErrorRow& H,
                           const ErrorVector& PH,
                           double innovation,
                           double variance);
  void Inject();

  const NavigationParams params_;
  const Mounting mounting_;
  const EarthModel earth_;
  double gyro_psd_ = 0.0;
  double accel_psd_ = 0.0;

  InertialState state_;
  ErrorVector biases_ = ErrorVector::Zero();
  InertialRates rates_;  // as measured, at the state's time
  ErrorMatrix P_ = ErrorMatrix::Zero();
  // Covariance of that part of the error that the DVL's noise has caused, were its scale known.
  ErrorMatrix P0_by_dvl_ = ErrorMatrix::Zero();
  Transition since_{ErrorMatrix::Identity(), ErrorVector::Zero()};
  ErrorVector correction_ = ErrorVector::Zero();
  StampError stamp_error_;
  // Steady-state sigma of each bias, and the rate at which it returns to it [1/s].
  ErrorVector bias_sigma_ = ErrorVector::Zero();
  ErrorVector bias_rate_ = ErrorVector::Zero();

  bool velocity_is_held_ = false;  // since the covariance was last brought up to the state
  bool estimates_slow_ = true;
  bool estimates_inertial_ = true;
  Eigen::Vector3d least_attitude_sigma_ = Eigen::Vector3d::Zero();  // stated so far
  Moves moves_;
  double heading_offset_rad_ = 0.0;  // what the device's heading adds beside its biases
  double doubt_rad_ = 0.0;
  int doubts_ = 0;  // number of doubts so far, with the present one

  // Since the covariance was last brought up to the state.
  double pending_s_ = 0.0;
  Eigen::Matrix3d pending_R_ = Eigen::Matrix3d::Zero();     // integral of R_map_imu
  Eigen::Vector3d pending_move_ = Eigen::Vector3d::Zero();  // integral of v_map

  struct Innovations {
    InnovationSummary summary;
    double mean_product = 0.0;  // autocorrelation of normalised innovations, lag one
    std::array<double, 3> last_by_sigma{};

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.summary, self.mean_product, self.last_by_sigma);
    }
  };
  std::array<Innovations, 4> innovations_{};
};

}  // namespace seastitch
