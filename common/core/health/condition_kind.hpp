#pragma once

#include <cstdint>
#include <string>

namespace seastitch {

// Severity of a fault, with the numbers of health_t's STATE_DEGRADED and STATE_LOST. kLost: the
// data of a sensor, or navigation, are missing. kDegraded: every other fault.
enum class Severity : std::int8_t { kDegraded = 2, kLost = 3 };

// When events, such as dropped datagrams, are a fault: for holds_s after the last one, where so
// many lie within the last within_s. See FaultEvents.
struct EventRule {
  double holds_s = 0.0;  // 0: the fault is a state, which holds while its cause does
  int fewest = 1;
  double within_s = holds_s;
};
// The rules of most events: of a process, by its monotonic clock; of a dive, by its samples' times.
inline constexpr EventRule kEventOfProcess{10.0};
inline constexpr EventRule kEventOfDive{60.0};

// Type of a fault that a process can report in HEALTH. A new type also goes into conditions::kAll;
// docs/health.md is generated from that list.
struct ConditionKind {
  const char* name;  // unique key for programs, such as "no_bottom_lock"; never renamed
  Severity severity;
  const char* sentence;  // message for people, one line without a full stop
  const char* remedy;    // what to do about it, in sentences
  EventRule events{};    // of a fault that is an event and not a state
};

// An active fault.
struct Condition {
  const ConditionKind* kind;
  std::string detail;  // values of this occurrence, "SENTENCE: DETAIL"; may be empty
};

}  // namespace seastitch
