#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/fault_events.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/navigation.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Monitor of dead reckoning for HEALTH: why it has not started, which sensor it refuses, resets,
// and sensors with wrong stamps. Pure; its time is that of the samples.
class NavigationWatch {
 public:
  explicit NavigationWatch(const NavigationParams& params) : params_(params) {}

  void Add(const ImuSample& sample);
  void Add(const DvlSample& sample);
  // Call it after navigation has taken a sample.
  void Look(const Navigation& navigation);

  std::vector<Condition> conditions(const Navigation& navigation) const;

 private:
  // A state that may last.
  struct Lasting {
    void Look(bool holds, std::optional<Time> now);
    void AddTo(std::vector<Condition>* conditions, const ConditionKind& kind) const;
    std::optional<Time> since;
  };

  // Share of the time that lies in gaps of the inertial data, and the rate of the samples, over the
  // last whole window. A silence is no slow sensor: it is left out.
  struct ImuRate {
    static constexpr double kWindowS = 10.0;
    static constexpr double kSilenceS = 2.0;
    void Add(Time t, double gap_s);
    bool IsTooSlow() const;
    double Hz() const;
    double share = 0.0;  // of the last window
    double rate_hz = 0.0;
    double measured_s = 0.0;  // of the open window
    double in_gaps_s = 0.0;
    int samples = 0;
    std::optional<Time> last;
  };

  bool SeesBottom() const;
  void AddImuRate(std::vector<Condition>* now) const;
  void AddDoubts(std::vector<Condition>* now) const;
  void AddRefusals(const Navigation& navigation, std::vector<Condition>* now) const;
  void AddDvl(const Navigation& navigation, std::vector<Condition>* now) const;
  void AddOffsets(const Navigation& navigation, std::vector<Condition>* now) const;

  NavigationParams params_;
  std::optional<Time> first_imu_;
  std::optional<Time> newest_imu_;
  ImuRate imu_rate_;
  std::optional<Time> last_attitude_;
  std::optional<Time> last_lock_;  // newest ensemble with bottom lock by its own flag
  FaultEvents<Time> resets_{conditions::kNavigationReset};
  FaultEvents<Time> heading_steps_{conditions::kHeadingStep};
  FaultEvents<Time> late_{conditions::kSamplesLate};
  Lasting gyros_doubted_;
  Lasting accelerometers_doubted_;
  Lasting attitude_frozen_;
};

}  // namespace seastitch
