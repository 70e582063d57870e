#pragma once

#include <array>
#include <cstdint>
#include <ostream>
#include <set>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper.hpp"

// What happens in a random dive, and when.
namespace seastitch {

enum class What {
  kSensorSilent,
  kAllSilent,
  kComputerSteps,
  kSensorSteps,
  kDuplicates,
  kReordered,
  kFixes,
  kDamaged,
  kRestart,
  kDriverRestart,
  kOptimizerRestart,
  kForeignGraph,
  kFixesByAnotherClock,
  kTwoSenders,
  kSlowImu,
};
inline constexpr int kWhats = 15;
inline constexpr std::array<const char*, kWhats> kNames{"sensor silent",
                                                        "all silent",
                                                        "computer's clock steps",
                                                        "sensor's clock steps",
                                                        "duplicates",
                                                        "reordered",
                                                        "fixes",
                                                        "damaged",
                                                        "restart",
                                                        "driver restarts",
                                                        "optimizer restarts",
                                                        "foreign graph",
                                                        "fixes by another clock",
                                                        "two senders",
                                                        "slow inertial unit"};
inline constexpr std::array kSensors{
    SensorChannel::kImu, SensorChannel::kDvl, SensorChannel::kDepth, SensorChannel::kMbesPing};

inline constexpr int kSolveEvery = 1500;  // inertial samples: 30 s

// Between two of them the dive goes on for ten seconds.
struct Happening {
  int what = 0;
  int size = 0;  // 0 to 100
  int sensor = 0;
  bool back = false;
  int seed = 0;

  // 1 s to 2 h.
  double seconds() const { return std::pow(7200.0, size / 100.0); }
  // 1 s to 10 days.
  double gap_s() const { return std::pow(864'000.0, size / 100.0); }
  double step_s() const { return (back ? -1.0 : 1.0) * (4.0 + seconds()); }
};

inline std::ostream& operator<<(std::ostream& out, const Happening& h) {
  return out << "{" << kNames[static_cast<std::size_t>(h.what)] << ", " << h.seconds() << " s"
             << (h.back ? " back" : "") << ", sensor " << h.sensor << ", seed " << h.seed << "}";
}

// What a dive has from its start.
struct Setting {
  int imu_every = 1;      // of the samples at 50 Hz, one in so many
  int wrong_sensor = -1;  // its clock is wrong until the first happening; negative: none
  double wrong_s = 0.0;   // by so much
  double speed = 1.0;     // of a player
  double first_fix_off_m = 0.0;
  int seed = 0;  // of the errors of its sensors, as of class mems
};

inline std::ostream& operator<<(std::ostream& out, const Setting& s) {
  return out << "{every " << s.imu_every << ", clock of sensor " << s.wrong_sensor << " wrong by "
             << s.wrong_s << " s, speed " << s.speed << ", first fix off by " << s.first_fix_off_m
             << " m, seed " << s.seed << "}";
}

}  // namespace seastitch
