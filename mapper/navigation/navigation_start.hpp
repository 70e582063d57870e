#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/core/time.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation_params.hpp"
#include "mapper/navigation/start_state.hpp"

namespace seastitch {

// Collects the measurements for the first state.
class NavigationStart {
 public:
  NavigationStart(const NavigationParams& params, const ErrorStateFilter::Mounting& mounting)
      : params_(params), mounting_(mounting) {}

  void Use(Time t, const DvlEvent& dvl) { dvl_ = {t, dvl}; }
  void Use(Time t, const DepthEvent& depth) { depth_ = {t, depth}; }
  // Fixes may come late and in any order: the newest one is used.
  void Use(Time t, const FixEvent& fix);
  void Use(Time t, const AttitudeEvent& attitude);

  struct First {
    ErrorStateFilter::Start start;
    AttitudeEvent attitude;
    std::optional<Time> dvl;  // time of the ensemble used for the velocity
    bool has_depth = false;
    bool place_is_known = false;
  };
  // Call it with each inertial sample. Nothing until the start is possible.
  std::optional<First> Try(Time t, const InertialRates& rates);
  StartState state() const { return state_; }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.state_,
            self.attitude_is_new_,
            self.steady_since_,
            self.attitude_,
            self.dvl_,
            self.depth_,
            self.fix_);
  }

 private:
  // Sigma of an unknown start position [m].
  static constexpr double kUnknownPlaceM = 1000.0;
  StartState StateAt(Time t) const;
  // How far the vehicle may have moved since the fix [m].
  double MovedSinceFix(Time t) const;
  bool HasFix(Time t) const { return fix_ && MovedSinceFix(t) < kUnknownPlaceM; }
  void Place(Time t, First* first) const;

  const NavigationParams params_;
  const ErrorStateFilter::Mounting mounting_;
  StartState state_ = StartState::kNoInertialData;
  bool attitude_is_new_ = false;
  std::optional<Time> steady_since_;
  std::optional<Stamped<AttitudeEvent>> attitude_;
  std::optional<Stamped<DvlEvent>> dvl_;
  std::optional<Stamped<DepthEvent>> depth_;
  std::optional<Stamped<FixEvent>> fix_;
};

}  // namespace seastitch
