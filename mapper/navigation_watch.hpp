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
  // After navigation has taken a sample.
  void Look(const Navigation& navigation);

  std::vector<Condition> conditions(const Navigation& navigation) const;

 private:
  // Events of one kind, by a counter that grows.
  struct Recent {
    void Look(std::int64_t count, std::optional<Time> now);
    void AddTo(std::vector<Condition>* conditions, const ConditionKind& kind, Time now) const;
    std::int64_t count = 0;
    std::optional<Time> last;
  };

  // Samples that came too late to be put in order: one in a while is nothing.
  struct Late {
    static constexpr std::size_t kMany = 10;
    void Look(const std::map<std::string, std::int64_t>& counters, std::optional<Time> now);
    void AddTo(std::vector<Condition>* conditions, Time now) const;
    std::int64_t count = 0;
    std::deque<Time> last;  // kMany of them
    std::string names;      // with how many of each
  };

  bool SeesBottom() const;
  void AddRefusals(const Navigation& navigation, std::vector<Condition>* now) const;
  void AddDvl(const Navigation& navigation, std::vector<Condition>* now) const;
  void AddOffsets(const Navigation& navigation, std::vector<Condition>* now) const;

  const NavigationParams params_;
  std::optional<Time> first_imu_;
  std::optional<Time> newest_imu_;
  std::optional<Time> last_lock_;  // newest ensemble with the flag of bottom lock
  Recent resets_;                  // of navigation to a sensor
  Recent heading_steps_;           // of the attitude device
  Late late_;
};

}  // namespace seastitch
