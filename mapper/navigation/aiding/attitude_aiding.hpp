#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "common/core/time.hpp"
#include "mapper/navigation/aiding/increment_watch.hpp"
#include "mapper/navigation/aiding/inertial_history.hpp"
#include "mapper/navigation/aiding/refusal_record.hpp"
#include "mapper/navigation/aiding/sample_pairs.hpp"
#include "mapper/navigation/aiding/stamp_offset.hpp"
#include "mapper/navigation/aiding/stuck_gyro_watch.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Attitude updates of the filter by the device (AHRS or INS), with detection of the faulty sensor
// where device, gyros and filter disagree:
//   seen    device and gyros disagree, sample after sample
//   faulty  the gyros, or the stamps
//   done    the attitude is reset to the device's with each sample, until they agree
//
//   seen    the gyros repeat to the last bit, and the device turns otherwise (StuckGyroWatch)
//   faulty  the gyros
//   done    the same, until they change and then agree
//
//   seen    the device's heading stepped once
//   done    two hypotheses: the device is wrong now, or was before (ErrorStateFilter)
//
//   seen    the device's attitude is identical to the last bit, while the gyros measure a rotation
//   faulty  the device: it is frozen, and not used until its attitude changes
//
//   seen    attitudes refused for gate_reset_s, for no such reason
//   faulty  the filter: the attitude is reset to the device's
class AttitudeAiding {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  // The history must reach up to each sample before the sample is used.
  AttitudeAiding(const NavigationParams& params,
                 const InertialHistory* history,
                 ErrorStateFilter* filter,
                 NavTally* tally);

  // Call at the start of the filter, with its initial attitude.
  void Begin(Time t, const AttitudeEvent& attitude);
  // Call after a gap in the inertial data, with the attitude that ended it, or null.
  void Resume(Time t, const AttitudeEvent* attitude);
  // Angular rate since the last inertial sample: as measured, bias included, imu axes.
  void AddTurn(const Eigen::Vector3d& rate_radps, double dt_s);
  void Use(Time t, const AttitudeEvent& attitude);

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.watch_, self.refusals_, self.begun_, self.compared_, self.agreed_);
    archive(self.aligned_, self.alignment_, self.in_doubt_, self.stamps_, self.pairs_);
    archive(self.last_, self.rate_from_, self.device_rate_radps_);
    archive(self.anchor_, self.turn_, self.turned_rad_);
    archive(self.stuck_, self.doubted_until_, self.doubted_, self.is_frozen_);
  }

  RefusalRecord* refusals() { return &refusals_; }
  bool gyros_in_doubt(Time t) const;
  // Whether biases of the inertial unit must not be estimated: a doubt about the gyros ends with an
  // attitude that agrees, or with the silence of the device.
  bool HoldsInertialBiases(Time t) const;
  bool is_frozen() const { return is_frozen_; }
  // False: more than a tenth of the attitudes of the last minute disagreed with gyros or filter.
  bool IsTrusted(Time t) const { return !refusals_.AreOften(t); }
  const StampOffset& stamps() const { return stamps_; }
  // The rates as measured. While the gyros are in doubt, the angular rate is the device's.
  InertialRates Sound(Time t, const InertialRates& measured) const;

 private:
  void Count(const std::string& name, std::int64_t n = 1) { tally_->Count(name, n); }
  bool IsRepeated(const AttitudeEvent& attitude) const;  // to the last bit
  bool LooksFrozen(const AttitudeEvent& attitude);
  // The attitude, extrapolated by the gyros from its time of measurement (t minus the suspected
  // delay) to t.
  AttitudeEvent CarriedTo(Time t, const AttitudeEvent& attitude) const;
  void EstimateRate(Time t, const AttitudeEvent& attitude);
  void EstimateStamps(Time t, const AttitudeEvent& attitude);
  void AddStampPair(const Stamped<Eigen::Quaterniond>& from,
                    const Stamped<Eigen::Quaterniond>& to,
                    double share);
  void UseCarried(Time t, const AttitudeEvent& attitude, bool compares);
  void Compare(Time t, const AttitudeEvent& attitude);
  void CompareStuck(Time t, const Eigen::Vector3d& difference_rad, double dt_s);
  // 1 sigma of the difference of rotations over dt_s [rad]. turned_rad: sum of the absolute
  // rotations. share: part of the time that does not overlap with other increments. bias_radps: of
  // the gyros, 1 sigma; by default the data sheet's.
  double IncrementSigma(double dt_s,
                        double turned_rad,
                        double share = 1.0,
                        std::optional<double> bias_radps = std::nullopt) const;
  bool Step(Time t, const AttitudeEvent& attitude);
  bool StepsBack(double step_rad);
  void Take(Time t, const AttitudeEvent& attitude);
  void Anchor(Time t, const AttitudeEvent* attitude);

  const NavigationParams params_;
  const InertialHistory* history_;
  ErrorStateFilter* filter_;
  NavTally* tally_;
  IncrementWatch watch_;
  RefusalRecord refusals_;
  Time begun_;
  Time compared_;  // last attitude that was compared with the gyros
  Time agreed_;    // the device and the filter, last
  std::optional<Time> aligned_;
  HeadingAlignment alignment_ = HeadingAlignment::kUnknown;
  bool in_doubt_ = false;
  StampOffset stamps_;
  SamplePairs<Eigen::Quaterniond> pairs_{StampOffset::kLongestS};  // as measured, for stamps_
  std::optional<Eigen::Quaterniond> last_;                         // as measured
  std::deque<Stamped<Eigen::Quaterniond>> rate_from_;              // as measured
  std::optional<Eigen::Vector3d> device_rate_radps_;               // from its first to its last
  // The last attitude that was compared, carried to its stamp, and the turn by the gyros since.
  std::optional<Stamped<Eigen::Quaterniond>> anchor_;
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  double turned_rad_ = 0.0;  // sum of the absolute rotations since
  StuckGyroWatch stuck_;
  std::optional<Time> doubted_until_;  // the gyros, after they were stuck
  std::optional<Time> doubted_;        // the gyros, last
  bool is_frozen_ = false;             // the device, until its attitude changes
};

}  // namespace seastitch
