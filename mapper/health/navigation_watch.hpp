#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/conditions.hpp"
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
  // Recent events of one kind, from a growing counter.
  struct Recent {
    void Look(std::int64_t count, std::optional<Time> now);
    void AddTo(std::vector<Condition>* conditions, const ConditionKind& kind, Time now) const;
    std::int64_t count = 0;
    std::optional<Time> last;
  };

  // A state that may last.
  struct Lasting {
    void Look(bool holds, std::optional<Time> now);
    void AddTo(std::vector<Condition>* conditions, const ConditionKind& kind) const;
    std::optional<Time> since;
  };

  // Samples that came too late to be used. A few are no fault.
  struct Late {
    static constexpr std::size_t kMany = 10;
    void Look(const std::map<std::string, std::int64_t>& by_sensor, std::optional<Time> now);
    void AddTo(std::vector<Condition>* conditions, Time now) const;
    std::int64_t count = 0;
    std::deque<Time> last;  // times of the last kMany of them
    std::string names;      // their sensors, with the number of each
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
  Recent resets_;                  // resets of navigation to a sensor
  Recent heading_steps_;           // steps of the attitude device's heading
  Lasting gyros_doubted_;
  Lasting accelerometers_doubted_;
  Lasting attitude_frozen_;
  Late late_;
};

}  // namespace seastitch
