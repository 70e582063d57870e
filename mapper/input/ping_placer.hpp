#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "common/core/for_each.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/noise/sonar_timing.hpp"

namespace seastitch {

// Places the soundings of pings in the map by jobs, which may run beside navigation, and keeps what
// they show of the sonar. All poses are looked up before.
class PingPlacer {
 public:
  void UseJobs(JobQueue* jobs) { jobs_ = jobs; }

  using Ping = std::shared_ptr<const GeoreferencedPing>;
  // ping: without soundings. georeference: makes them, in a job. T_map_vehicle_at: about the time
  // of the ping before, up to that of this one. The soundings are in the result once the queue has
  // finished.
  Ping Place(GeoreferencedPing ping,
             std::function<PingSoundings()> georeference,
             const PoseLookup& T_map_vehicle_at);

  // Of all pings placed.
  struct Tally {
    std::int64_t beams_read = 0;
    std::int64_t beams_invalid = 0;
    std::int64_t beams_refused = 0;
    std::int64_t beams_of_unknown_part = 0;
    std::int64_t speeds_from_profile = 0;  // pings with an implausible sound speed
  };
  // Both wait for all jobs.
  Tally tally() const;
  SonarTimingEstimate timing() const;

 private:
  JobQueue* jobs_ = JobsInTurn();
  Tally tally_;
  SonarTiming timing_;
};

}  // namespace seastitch
