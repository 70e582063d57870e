#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/navigation_params.hpp"
#include "mapper/navigation/strapdown.hpp"

namespace seastitch {

// Order of the error state. Truth = estimate + error, but for two: the attitude error is a rotation
// vector in map axes, R_true = Exp(tilt) R_estimate, and the velocity error is what is left when
// the estimate has been turned by it, v_true = Exp(tilt) v_estimate + error. Written so (invariant
// form: Barrau and Bonnabel, IEEE Trans. Automatic Control 62(4), 2017) a DVL's component does not
// depend on heading at all, and the filter cannot talk itself into knowing heading from it.
enum ErrorIndex : int {
  kPosition = 0,        // m, map
  kVelocity = 3,        // m/s, map
  kTilt = 6,            // rad, map: attitude
  kGyroBias = 9,        // rad/s, imu
  kAccelBias = 12,      // m/s2, imu
  kDvlScale = 15,       // measured = (1 + scale) * true
  kDvlMounting = 16,    // rad, dvl: measured = Exp(mounting) true
  kAttitudeBias = 19,   // rad: what the device adds to roll, pitch, yaw, for long
  kHeadingWander = 22,  // rad: and to yaw, for minutes
  kDeviation = 23,      // rad: and to yaw, times its sine and its cosine
  kDepthBias = 25,      // m: what the pressure sensor adds to depth
  kHeadingDoubt = 26,   // 0 or 1: whether the other hypothesis of the heading is the right one
  kErrorSize = 27,
};

constexpr int kNavSize = kGyroBias;  // position, velocity, tilt
constexpr int kBiasSize = kErrorSize - kNavSize;

using ErrorVector = Eigen::Matrix<double, kErrorSize, 1>;
using ErrorMatrix = Eigen::Matrix<double, kErrorSize, kErrorSize>;
using ErrorRow = Eigen::Matrix<double, 1, kErrorSize>;
using AttitudeRows = Eigen::Matrix<double, 3, kErrorSize>;

// Of an ensemble of the DVL: by what it changes in a second, and over how long it was carried
// forward to its stamp.
struct DvlStamping {
  Eigen::Vector3d change_mps2 = Eigen::Vector3d::Zero();  // dvl
  double carried_s = 0.0;
};

// Error-state Kalman filter of the inertial unit's motion; the error model is that of Groves,
// Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., 14.2.3,
// for a frame fixed to the Earth. Knows no time of day, no order of samples and no bad input: its
// caller does.
//
// Beside state and covariance it keeps the transition of the error since TakeTransition(): the
// product A of every (I - K H) and F on the way, so that of two frozen estimates
// Cov(error(b), error(a)) = A(a to b) Cov(error(a)).
// And what the measurements on the way told of the error at its start: Cov(error(a)) times that
// news is what hindsight at b corrects in the estimate frozen at a (Bierman, Factorization Methods
// for Discrete Sequential Estimation, 1977, ch. X: the modified Bryson-Frazier smoother).
class ErrorStateFilter {
 public:
  // Lever arms and mountings from the inertial unit's point of view.
  struct Mounting {
    Eigen::Isometry3d T_imu_vehicle = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d T_imu_dvl = Eigen::Isometry3d::Identity();
    Eigen::Vector3d p_imu_depth = Eigen::Vector3d::Zero();
  };
  // What the start does not get from the device's attitude.
  struct Start {
    Eigen::Vector3d p_map_imu = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
    Eigen::Vector3d sigma_p_m = Eigen::Vector3d::Ones();
    double sigma_v_mps = 1.0;
  };

  ErrorStateFilter(const NavigationParams& params,
                   const Mounting& mounting,
                   const EarthModel& earth);

  // sigma_rpy_rad: the device's own; what params state holds where that is more.
  void Initialise(const Start& start,
                  const Eigen::Quaterniond& q_map_imu,
                  const Eigen::Vector3d& sigma_rpy_rad);

  // Raw rates as measured, changing evenly over dt_s.
  void Propagate(const InertialRates& from, const InertialRates& to, double dt_s);
  // The same without the accelerometers, which are in doubt: the velocity along the vehicle's own
  // axes stays.
  void PropagateHoldingVelocity(const InertialRates& from, const InertialRates& to, double dt_s);
  // Over a hole in the inertial data: straight on, and the attitude anew from the device, or where
  // there is none as it was.
  void Coast(double dt_s,
             const std::optional<Eigen::Quaterniond>& q_map_imu,
             const InertialRates& now);

  // Each gives how many components were refused by the gate.
  int UpdateAttitude(const Eigen::Quaterniond& q_map_imu, const Eigen::Vector3d& sigma_rpy_rad);
  // Whole ensembles: none of it is used where a component is refused.
  enum class SlowStates : std::uint8_t { kLearned, kLeft };  // scale and mounting of the DVL
  int UpdateDvl(const Eigen::Vector3d& v_dvl_mps,
                const Eigen::Vector3d& sigma_mps,
                const DvlStamping& stamping = {},
                SlowStates slow = SlowStates::kLearned);
  int UpdateDepth(double depth_m, double sigma_m);
  int UpdatePosition(const Eigen::Vector2d& north_east_m, const Eigen::Matrix2d& covariance_m2);

  // A state is set to what is measured, and its error is that of the measurement.
  void TakeAttitude(const Eigen::Quaterniond& q_map_imu, const Eigen::Vector3d& sigma_rpy_rad);
  void TakeVelocity(const Eigen::Vector3d& v_dvl_mps,
                    const Eigen::Vector3d& sigma_mps,
                    const DvlStamping& stamping = {});
  void TakeDepth(double depth_m, double sigma_m);
  void TakePosition(const Eigen::Vector2d& north_east_m, const Eigen::Matrix2d& covariance_m2);
  // What a state that was wrong has done to the position, and how wrong that may be.
  void MovePosition(const Eigen::Vector3d& by_m);
  void WidenPosition(const Eigen::Matrix3d& by_m2);
  // Resets the uncertainty of biases to the data sheet's: they may have been learned from a wrong
  // sensor. The attitude's bias is reopened only where the attitude is taken anew right after:
  // without its correlation with the tilt the next attitude would count twice.
  void ReopenInertialBiases();
  // What the sensors say beside an inertial unit that is in doubt says nothing of its biases.
  void LearnInertialBiases(bool learn) { learns_inertial_ = learn; }
  void ReopenAttitudeBias();
  void LimitSpeed(double limit_mps);

  // The device's heading has made a step that the gyros did not feel. Two hypotheses from then on:
  // it is wrong now (the heading stays), or was before (the heading follows). The state is that of
  // the one, and the covariance about it holds both, until the device steps back or positions
  // decide.
  void KeepHeadingOverStep(double step_rad);
  void FollowHeadingStep(double step_rad);
  enum class HeadingHypothesis : std::uint8_t { kOwn, kOther };
  // The state moves to the one that is right.
  void EndHeadingDoubt(HeadingHypothesis right);
  // The device is back where it was.
  void TrustDeviceHeading();
  // By how much the other hypothesis has more heading; 0: there is none.
  double heading_doubt_rad() const { return doubt_rad_; }
  // The error of the state where the other one is right. Brings the covariance up to the state.
  struct HeadingDoubt {
    int number = 0;  // of the doubt; 0: there is none
    ErrorVector error = ErrorVector::Zero();
  };
  HeadingDoubt heading_doubt();
  // What the device adds to the heading by steps that the filter did not follow.
  double heading_offset_rad() const { return heading_offset_rad_; }
  // Of the device's heading against what is expected of it.
  double HeadingResidual(const Eigen::Quaterniond& q_map_imu) const;
  double HeadingResidualSigma();
  Eigen::Vector3d DvlResidual(const Eigen::Vector3d& v_dvl_mps) const;
  Eigen::Vector3d AttitudeResidual(const Eigen::Quaterniond& q_map_imu) const;

  InertialRates WithoutBias(const InertialRates& measured) const;

  // The vehicle frame, now.
  Eigen::Isometry3d T_map_vehicle() const;
  Eigen::Vector3d v_map_vehicle_mps() const;
  // Rows: x, y, z [m], roll, pitch, yaw [rad], v north, v east [m/s] of the vehicle frame by error
  // state.
  Eigen::Matrix<double, 8, kErrorSize> VehicleJacobian() const;

  const InertialState& state() const { return state_; }
  const ErrorVector& biases() const { return biases_; }  // nine zeros, then as ErrorIndex
  // Brings the covariance up to the state, and returns it.
  const ErrorMatrix& covariance();
  struct Transition {
    ErrorMatrix A;
    ErrorVector news;  // sum of A^T H^T innovation / its variance, A up to each measurement

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.A, self.news);
    }
  };
  // Since the last call (or the start).
  Transition TakeTransition();
  const ErrorVector& news() const { return since_.news; }
  // What the stamps of the DVL have done to the state. Late by d seconds, they have made the error
  // d by_delay - by_carrying, beside the one that the covariance is of: a considered parameter
  // (Schmidt), of which the filter itself knows nothing.
  struct StampError {
    ErrorVector by_delay = ErrorVector::Zero();     // a second
    ErrorVector by_carrying = ErrorVector::Zero();  // with what carrying forward took off

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.by_delay, self.by_carrying);
    }
  };
  // Brings it up to the state, and returns it.
  const StampError& stamp_error();

  InnovationSummary innovations(NavSensor sensor) const;
  // How often the position was moved by what no motion and no weighing explains, and how far in
  // all.
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
    archive(self.bias_sigma_, self.bias_rate_, self.velocity_is_held_, self.learns_slow_);
    archive(self.learns_inertial_);
    archive(self.least_attitude_sigma_, self.moves_, self.heading_offset_rad_, self.doubt_rad_);
    archive(self.doubts_);
    archive(self.pending_s_, self.pending_R_, self.pending_move_, self.innovations_);
  }
  bool IsFinite() const;

 private:
  void ReopenBiases(int first, int size);
  void Step(const InertialRates& from, const InertialRates& to, double dt_s);
  Eigen::Vector3d ForceThatHolds(const Eigen::Vector3d& rate_radps) const;
  Eigen::Vector3d TurnOverGround() const;  // as the gyros feel it, imu
  struct DvlModel {
    Eigen::Vector3d expected_mps;
    Eigen::Matrix<double, 3, kErrorSize> H;
  };
  DvlModel ModelDvl() const;
  Eigen::Vector3d DvlSigma(const Eigen::Vector3d& sigma_mps) const;
  void PropagateCovariance();
  // What the device adds to roll, pitch, yaw, by error state.
  AttitudeRows DeviceErrorRows() const;
  Eigen::Quaterniond WithoutStep(const Eigen::Quaterniond& q_map_imu) const;
  Eigen::Quaterniond WithoutDeviceError(const Eigen::Quaterniond& q_map_imu) const;
  void AlignWithDevice();
  void FollowStatedSigma(int axis, double sigma);
  void LoseHeading(double lost_rad);
  void ShrinkBias(int i, double before, double after);
  void DoubtHeading(double other_rad);
  void TurnWayByDoubt();
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
  // Before the update by such a scalar, with PH = P_ H^T: takes from the correction what noise
  // times noise would teach of the DVL's scale.
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
  // Of each bias: sigma when left alone, and how fast it forgets.
  ErrorVector bias_sigma_ = ErrorVector::Zero();
  ErrorVector bias_rate_ = ErrorVector::Zero();

  bool velocity_is_held_ = false;  // since the covariance was last brought up to the state
  bool learns_slow_ = true;
  bool learns_inertial_ = true;
  Eigen::Vector3d least_attitude_sigma_ = Eigen::Vector3d::Zero();  // stated so far
  Moves moves_;
  double heading_offset_rad_ = 0.0;  // what the device's heading adds beside its biases
  double doubt_rad_ = 0.0;
  int doubts_ = 0;  // that there were, with this one

  // Since the covariance was last brought up to the state.
  double pending_s_ = 0.0;
  Eigen::Matrix3d pending_R_ = Eigen::Matrix3d::Zero();     // integral of R_map_imu
  Eigen::Vector3d pending_move_ = Eigen::Vector3d::Zero();  // integral of v_map

  struct Innovations {
    InnovationSummary summary;
    double mean_product = 0.0;  // of a component's innovation over sigma with its last
    std::array<double, 3> last_by_sigma{};

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.summary, self.mean_product, self.last_by_sigma);
    }
  };
  std::array<Innovations, 4> innovations_{};
};

}  // namespace seastitch
