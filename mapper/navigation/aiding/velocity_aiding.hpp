#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/core/time.hpp"
#include "mapper/navigation/aiding/increment_watch.hpp"
#include "mapper/navigation/aiding/inertial_history.hpp"
#include "mapper/navigation/aiding/refusal_record.hpp"
#include "mapper/navigation/aiding/sample_pairs.hpp"
#include "mapper/navigation/aiding/stamp_offset.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Velocity updates of the filter by the DVL, with detection of the faulty sensor where DVL,
// inertial unit and filter disagree:
//   seen    DVL and accelerometers disagree, ensemble after ensemble
//   faulty  the accelerometers, roll and pitch, or the stamps
//   done    the velocity is reset to the DVL's with each ensemble, until they agree
//
//   seen    the DVL's velocity stepped once, and the accelerometers measured nothing
//   faulty  the DVL
//   done    it is not used until it steps back, or until dvl_step_s has passed and the filter's
//           velocity sigma is above a third of the step; 300 s at most. Then it is followed, and
//           the step is forgotten after a loss of lock of 10 s, or after 300 s.
//
//   seen    ensembles refused for gate_reset_s, for neither reason
//   faulty  the filter
//   done    the velocity is reset to the DVL's
class VelocityAiding {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  VelocityAiding(const NavigationParams& params,
                 const ErrorStateFilter::Mounting& mounting,
                 const Eigen::Vector3d& gravity_mps2,
                 const InertialHistory* history,
                 ErrorStateFilter* filter,
                 NavTally* tally);

  // Call once if the filter's initial velocity is an ensemble's; t: time of the ensemble.
  void Begin(Time t) { used_ = t; }
  // Call after a gap in the inertial data: the next ensemble is not compared with the last.
  void Interrupt();
  // Specific force since the last inertial sample: as measured, bias included, imu axes.
  void AddForce(const Eigen::Vector3d& force_mps2, double dt_s);
  // Uses an ensemble. rate_radps: angular rate, imu axes. attitude_is_sound:
  // AttitudeAiding::IsTrusted().
  void Use(Time t, const DvlEvent& dvl, const Eigen::Vector3d& rate_radps, bool attitude_is_sound);
  // Doubts the accelerometers for kDoubtS: they integrated to a speed above max_speed_mps.
  void DoubtAccelerometers(Time t) { doubted_until_ = t + FromSeconds(kDoubtS); }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.watch_, self.refusals_, self.stamps_, self.pairs_, self.used_, self.agreed_);
    archive(self.doubted_until_, self.in_doubt_, self.doubted_, self.is_sound_);
    archive(self.last_force_mps2_, self.repeated_s_, self.followed_since_, self.off_by_step_m_);
    archive(self.last_, self.change_mps_, self.beside_m_, self.off_mps_);
  }

  // The last ensemble by which the velocity was corrected.
  std::optional<Time> used() const { return used_; }
  RefusalRecord* refusals() { return &refusals_; }
  const StampOffset& stamps() const { return stamps_; }
  bool accelerometers_in_doubt(Time t) const;

 private:
  static constexpr double kDoubtS = 5.0;
  void Count(const std::string& name, std::int64_t n = 1) { tally_->Count(name, n); }
  // Velocity of the inertial unit over ground, map axes.
  Eigen::Vector3d ImuVelocity(const DvlEvent& dvl, const Eigen::Vector3d& rate_radps) const;
  // Gravity in the history's axes: those of the inertial unit when the InertialHistory began.
  Eigen::Vector3d Gravity(Time t) const;
  // Velocity of the inertial unit over ground by an ensemble measured at `then`, in those axes.
  Eigen::Vector3d VelocityAt(const InertialHistory::Moment& then, const DvlEvent& dvl) const;
  void EstimateStamps(Time t, const DvlEvent& dvl);
  // share: part of the pair's time that does not overlap with other pairs.
  void AddStampPair(Time now,
                    const Stamped<DvlEvent>& from,
                    const Stamped<DvlEvent>& to,
                    double share);
  // The ensemble, extrapolated by the inertial unit from its time of measurement (t minus the
  // suspected delay) to t.
  DvlEvent CarriedTo(Time t, const DvlEvent& dvl) const;
  Eigen::Vector3d Carried(Time t, const DvlEvent& dvl, double delay_s) const;
  DvlStamping StampingOf(Time t, const DvlEvent& dvl) const;
  void UseCarried(Time t, const DvlEvent& dvl, const Eigen::Vector3d& rate_radps);
  // 1 sigma of the drift of velocity in dt_s by accelerometer bias and tilt error [m/s].
  double DriftSigma(double dt_s) const;
  double IncrementSigma(const DvlEvent& dvl, double dt_s) const;
  void Decide(Time t, const DvlEvent& dvl);
  Eigen::Vector3d Off(const DvlEvent& dvl) const;  // DVL minus filter velocity, map axes
  void AccumulateDisplacementError(const DvlEvent& dvl, double dt_s);
  void Compare(Time t, const DvlEvent& dvl, const Eigen::Vector3d& rate_radps);
  bool KnowsStep() const;
  void ForgetOldStep(Time t);
  bool RefusesStep(Time t, const DvlEvent& dvl);
  // Weigh: update with gate. Follow: reset of the velocity to the DVL's. Take: the same, with the
  // displacement since the two last agreed.
  void Weigh(Time t, const DvlEvent& dvl);
  void Take(Time t, const DvlEvent& dvl);
  void Move(const Eigen::Vector3d& way_m);
  void Follow(Time t, const DvlEvent& dvl);

  const NavigationParams params_;
  const ErrorStateFilter::Mounting mounting_;
  const Eigen::Vector3d gravity_mps2_;
  const InertialHistory* history_;
  ErrorStateFilter* filter_;
  NavTally* tally_;
  IncrementWatch watch_;
  RefusalRecord refusals_;
  StampOffset stamps_;
  SamplePairs<DvlEvent> pairs_{StampOffset::kLongestS};  // as measured, for stamps_
  std::optional<Time> used_;
  std::optional<Time> agreed_;  // DVL and filter, last
  std::optional<Time> doubted_until_;
  bool in_doubt_ = false;
  std::optional<Time> doubted_;  // the accelerometers, last
  // The attitude is not refused, and the accelerometers were not in doubt for a minute.
  bool is_sound_ = true;
  Eigen::Vector3d last_force_mps2_ = Eigen::Vector3d::Zero();
  double repeated_s_ = 0.0;  // seconds for which the force was identical
  // Since when a step of the DVL is followed, because the filter got too uncertain; and the
  // position error that the step would cause.
  std::optional<Time> followed_since_;
  Eigen::Vector3d off_by_step_m_ = Eigen::Vector3d::Zero();
  // Distance by DVL minus distance by filter over the last seconds [m], map axes.
  Eigen::Vector3d beside_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d off_mps_ = Eigen::Vector3d::Zero();  // after the last ensemble
  // By an ensemble, of the inertial unit over ground.
  struct Measured {
    Time time;
    Eigen::Vector3d v_map_mps;
    Eigen::Quaterniond q_map_imu;
    // The velocity without a step of the DVL, imu axes.
    Eigen::Vector3d Without(const Eigen::Vector3d& step_imu_mps) const {
      return v_map_mps - q_map_imu * step_imu_mps;
    }

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.v_map_mps, self.q_map_imu);
    }
  };
  std::optional<Measured> last_;
  Eigen::Vector3d change_mps_ = Eigen::Vector3d::Zero();  // by the accelerometers since then
};

}  // namespace seastitch
