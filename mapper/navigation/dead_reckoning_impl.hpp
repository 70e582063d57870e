#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/archive.hpp"
#include "mapper/navigation/aiding/attitude_aiding.hpp"
#include "mapper/navigation/aiding/inertial_history.hpp"
#include "mapper/navigation/aiding/refusal_record.hpp"
#include "mapper/navigation/aiding/sample_pairs.hpp"
#include "mapper/navigation/aiding/stamp_offset.hpp"
#include "mapper/navigation/aiding/velocity_aiding.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"
#include "mapper/navigation/filter/nav_track.hpp"
#include "mapper/navigation/fix_keeper.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_start.hpp"
#include "mapper/navigation/sample_intake.hpp"

namespace seastitch {

// The parts of DeadReckoning, and the order in which they process a sample.
class DeadReckoning::Impl {
 public:
  Impl(const NavigationParams& params, const VehicleGeometry& vehicle);

  template <class Sample>
  void Add(const Sample& sample) {
    intake_.Add(sample);
    Process();
  }
  void Add(const PositionFix& fix);
  void AddSoundSpeed(Time t, double speed_mps);
  void Finish();
  std::vector<SmoothedPose> TakeSmoothed(Time until) { return track_.TakeSmoothed(until); }
  std::vector<MapFix> WaitingFixes() const { return fixes_.Waiting(); }
  std::vector<MapFix> TakeFixes(Time until) { return fixes_.Take(until); }
  std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const;
  // False: not usable; some members may have been overwritten.
  bool Restore(Bytes saved);
  std::unique_ptr<Impl> Anew() const { return std::make_unique<Impl>(params_, vehicle_); }

  // Not saved: tally_, which belongs to one process; track_, of which only a part is needed;
  // intervals_s_ and longest_interval_s_, which a restart interrupts.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.intake_, self.filter_, self.start_, self.history_, self.attitude_, self.velocity_);
    archive(self.depth_refusals_, self.fix_refusals_, self.refused_fixes_, self.fixes_);
    archive(self.dvl_correction_, self.started_, self.place_is_known_, self.started_at_);
    archive(self.now_, self.rates_, self.between_, self.resumed_);
  }

  StartState start_state() const { return start_.state(); }
  bool place_is_known() const { return place_is_known_; }
  bool starts_from_fix() const { return params_.start_at_first_fix; }
  NavSensorHealth health(NavSensor sensor);
  NavDoubts doubts() const;
  // The filter has the rotation of what the log measures, which turns against the log itself.
  double dvl_yaw_rad() const { return -filter_.biases()[kDvlMounting + 2]; }
  std::vector<SuspectedOffset> suspected_offsets() const;
  std::optional<NavState> Predicted() const;
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const {
    const StampOffset& dvl = velocity_.stamps();
    return track_.RelativeCovariance(a, b, dvl.IsSuspected() ? &dvl : nullptr);
  }
  const NavTrack& track() const { return track_; }
  const ErrorStateFilter& filter() const { return filter_; }
  const NavTally& tally() const { return tally_; }

 private:
  // Long enough to compare any pair of samples with any delay of their stamps.
  static constexpr double kHistoryS =
      2.0 * StampOffset::kLongestS + 2.0 * SamplePairs<DvlEvent>::kMostS;
  void Count(const std::string& name, std::int64_t n = 1) { tally_.Count(name, n); }
  void Process();
  void Handle(const Event& event);
  void RememberForStart(const Event& event);
  void StartWith(Time t, const DvlEvent& dvl);
  void Start(Time t, const InertialRates& rates);
  void Advance(Time t, const InertialRates& rates);
  void AddInterval(double s);  // of inertial samples
  void CoastTo(Time t, const InertialRates& rates);
  std::optional<AttitudeEvent> AttitudeAfterGap(Time t, const InertialRates& rates) const;
  void IntegrateTo(Time t, const InertialRates& rates);
  void Propagate(Time to_time, const InertialRates& from, const InertialRates& to, double dt_s);
  void Publish(Time t, const InertialRates& rates);
  void LimitSpeed(Time t);
  void Use(const Event& event, const InertialRates& rates);
  void UseSoundSpeed(const SoundSpeedEvent& water);
  DvlEvent Corrected(const DvlEvent& dvl) const;
  bool IsPossible(const DvlEvent& dvl, const InertialRates& rates);
  void UseDvl(Time t, const DvlEvent& dvl, const InertialRates& rates);
  void UseDepth(Time t, const DepthEvent& depth);
  void UseFix(Time t, const FixEvent& of_antenna);
  struct RefusedFix {
    // from the filter's position, which drifts little between successive fixes
    Eigen::Vector2d off_m;
    Eigen::Matrix2d covariance_m2;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.off_m, self.covariance_m2);
    }
  };
  RefusalRecord* RefusalsOf(NavSensor sensor);
  bool OverruleByFixes(const RefusedFix& fix);
  void UseLateFix(Time t, const FixEvent& fix);
  bool KeepPastFix(Time t, const FixEvent& of_antenna);

  const NavigationParams params_;
  const VehicleGeometry vehicle_;
  const ErrorStateFilter::Mounting mounting_;
  const EarthModel earth_;
  NavTally tally_;
  SampleIntake intake_;
  ErrorStateFilter filter_;
  NavigationStart start_;
  InertialHistory history_{kHistoryS};
  AttitudeAiding attitude_;
  VelocityAiding velocity_;
  RefusalRecord depth_refusals_;
  RefusalRecord fix_refusals_;
  std::vector<RefusedFix> refused_fixes_;  // consecutive, and in agreement with each other
  FixKeeper fixes_;
  NavTrack track_;

  double dvl_correction_ = 1.0;  // factor of its velocity, for the sound speed
  bool started_ = false;
  bool place_is_known_ = false;
  Time started_at_;
  Time now_;
  InertialRates rates_;
  std::vector<Event> between_;      // aiding samples since now_
  std::deque<double> intervals_s_;  // of the last inertial samples
  // Longest interval over which rates are integrated: imu_gap_s, or of a slow unit 1.5 of its own.
  double longest_interval_s_;
  std::optional<Time> resumed_;  // first inertial sample after a gap that is not bridged yet
};

}  // namespace seastitch
