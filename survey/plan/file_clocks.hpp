#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "codecs/survey_records.hpp"

namespace seastitch {

// How the stamps of one source of navigation in a file lie to the sonar's own clock.
struct ClockOffset {
  double ahead_s = 0.0;    // of the sonar's clock: median
  double speed_mps = 0.0;  // of the vehicle: mean; 0 = not known, or of a clock
  bool is_moved = false;   // a whole number of seconds, which the reader takes off
  enum class Of { kPosition, kAttitude, kClock } of = Of::kAttitude;
};

// Way of the vehicle in the time by which a clock is off [m]; absent: not known.
std::optional<double> EffectOf(const ClockOffset& clock);
// What a clock that is off means for the map: a line for people.
std::string ClockText(const std::string& source, const ClockOffset& clock);

// Compares the stamps of sensors with the clock of the sonar that recorded them. A position with a
// time of arrival (NavigationRecord::arrival) shows its offset to some milliseconds. Of other
// records the pings before and after them in the file show it to about a second, if they are
// recorded as they come. A comparison of the sonar's clock with the one that sets it (#SCL, C)
// shows how far a sensor may be off that is set by the same.
//
// An offset is one of the whole file, at least 0.9 s. It is moved if a position, or a comparison of
// clocks, shows that it is a whole number of seconds within 30 ms (GPS time in place of UTC: 18 s);
// other records that the pings show to be off by the same are moved with it. A smaller or varying
// latency, as of a serial line, is none.
class FileClocks {
 public:
  // In the order of the file.
  void Add(const NavigationRecord& record);
  void Add(const ClockComparison& clock);
  void AddPing(Time time, double travel_time_s);

  // The sources that are off. For one file; begins anew.
  std::map<std::string, ClockOffset> Finish();

 private:
  struct Source {
    ClockOffset::Of of = ClockOffset::Of::kAttitude;
    std::vector<double> by_arrival_s;  // of a clock: by its comparisons
    std::vector<double> by_pings_s;
    std::optional<Time> last;  // since the last ping
    std::optional<NavigationRecord> place;
    double distance_m = 0.0;
    double time_s = 0.0;
  };

  std::map<std::string, Source> sources_;
  std::optional<Time> ping_;
};

}  // namespace seastitch
