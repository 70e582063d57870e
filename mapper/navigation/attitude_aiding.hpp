#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/core/time.hpp"
#include "mapper/navigation/error_state_filter.hpp"
#include "mapper/navigation/increment_watch.hpp"
#include "mapper/navigation/inertial_history.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"
#include "mapper/navigation/refusal_record.hpp"
#include "mapper/navigation/sample_pairs.hpp"
#include "mapper/navigation/stamp_offset.hpp"

namespace seastitch {

// Corrects the filter by the device's attitude, and finds out who is wrong where they disagree:
//   device and gyros disagree from sample to sample  the gyros, or the stamps: the attitude is the
//                                                    device's until they agree again
//   the device's heading has stepped, once           two hypotheses (ErrorStateFilter)
//   the device says the same to the last bit while   the device is frozen, and not used
//   the gyros feel a turn
//   refused for gate_reset_s for no such reason      the filter: the attitude is the device's anew
class AttitudeAiding {
 public:
  using Counters = std::map<std::string, std::int64_t>;
  // The history holds what the gyros felt up to each sample.
  AttitudeAiding(const NavigationParams& params,
                 const InertialHistory* history,
                 ErrorStateFilter* filter,
                 Counters* counters);

  // The filter was started with this attitude.
  void Begin(Time t, const AttitudeEvent& attitude);
  // It was carried over a gap, by this one where there is one.
  void Resume(Time t, const AttitudeEvent* attitude);
  // What the gyros have felt since the last inertial sample.
  void AddTurn(const Eigen::Vector3d& rate_radps, double dt_s);
  void Use(Time t, const AttitudeEvent& attitude);

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.watch_, self.refusals_, self.begun_, self.compared_, self.agreed_);
    archive(self.aligned_, self.alignment_, self.in_doubt_, self.stamps_, self.pairs_);
    archive(self.last_, self.rate_from_, self.device_rate_radps_);
    archive(self.anchor_, self.turn_, self.turned_rad_);
    archive(self.last_rate_radps_, self.repeated_s_, self.doubted_until_);
  }

  const RefusalRecord& refusals() const { return refusals_; }
  const StampOffset& stamps() const { return stamps_; }
  // The rates as measured, and where the gyros are in doubt the device's turn in their place.
  InertialRates Sound(Time t, const InertialRates& measured) const;

 private:
  void Count(const std::string& name, std::int64_t n = 1) { (*counters_)[name] += n; }
  bool gyros_in_doubt(Time t) const;
  bool IsRepeated(const AttitudeEvent& attitude) const;  // to the last bit
  bool IsFrozen(const AttitudeEvent& attitude) const;
  // By the gyros from when it was measured, as far as the stamps are suspected, until t.
  AttitudeEvent CarriedTo(Time t, const AttitudeEvent& attitude) const;
  void LearnRate(Time t, const AttitudeEvent& attitude);
  void LearnStamps(Time t, const AttitudeEvent& attitude);
  void LearnFrom(const Stamped<Eigen::Quaterniond>& from,
                 const Stamped<Eigen::Quaterniond>& to,
                 double share);
  void UseCarried(Time t, const AttitudeEvent& attitude, bool compares);
  void Compare(Time t, const AttitudeEvent& attitude);
  // turned_rad: the way there and back. share: of the time that is this increment's alone; what
  // drifts is common to those that overlap.
  double IncrementSigma(double dt_s, double turned_rad, double share = 1.0) const;
  bool Step(Time t, const AttitudeEvent& attitude);
  bool StepsBack(double step_rad);
  void Take(Time t, const AttitudeEvent& attitude);
  void Anchor(Time t, const AttitudeEvent* attitude);

  const NavigationParams params_;
  const InertialHistory* history_;
  ErrorStateFilter* filter_;
  Counters* counters_;
  IncrementWatch watch_;
  RefusalRecord refusals_;
  Time begun_;
  Time compared_;  // and used, where the gyros are not in doubt
  Time agreed_;    // the device and the filter, last
  std::optional<Time> aligned_;
  Alignment alignment_ = Alignment::kUnknown;
  bool in_doubt_ = false;
  Eigen::Vector3d last_rate_radps_ = Eigen::Vector3d::Zero();
  double repeated_s_ = 0.0;            // for which it has been the same
  std::optional<Time> doubted_until_;  // the gyros, since they are stuck
  StampOffset stamps_;
  SamplePairs<Eigen::Quaterniond> pairs_{StampOffset::kLongestS};  // as measured, for stamps_
  std::optional<Eigen::Quaterniond> last_;                         // as measured
  std::optional<Stamped<Eigen::Quaterniond>> rate_from_;           // as measured
  std::optional<Eigen::Vector3d> device_rate_radps_;               // from then to the next
  // The last attitude that was compared, carried to its stamp, and the turn by the gyros since.
  std::optional<Stamped<Eigen::Quaterniond>> anchor_;
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  double turned_rad_ = 0.0;  // the way there and back
};

}  // namespace seastitch
