#include "mapper/input/ping_placer.hpp"

#include <optional>
#include <utility>

namespace seastitch {

PingPlacer::Ping PingPlacer::Place(GeoreferencedPing ping,
                                   std::function<PingSoundings()> georeference,
                                   const PoseLookup& T_map_vehicle_at) {
  const std::optional<SonarTiming::Roll> roll = timing_.RollBefore(ping, T_map_vehicle_at);
  const auto placed = std::make_shared<GeoreferencedPing>(std::move(ping));
  jobs_->Add([this, placed, roll, georeference = std::move(georeference)] {
    static_cast<PingSoundings&>(*placed) = georeference();
    tally_.beams_read += placed->beams_read;
    tally_.beams_invalid += placed->beams_invalid;
    tally_.beams_refused += placed->beams_refused;
    tally_.beams_of_unknown_part += placed->beams_of_unknown_part;
    tally_.speeds_from_profile += placed->speed_from_profile ? 1 : 0;
    timing_.Add(*placed, roll);
  });
  return placed;
}

PingPlacer::Tally PingPlacer::tally() const {
  jobs_->Finish();
  return tally_;
}

SonarTimingEstimate PingPlacer::timing() const {
  jobs_->Finish();
  return timing_.estimate();
}

}  // namespace seastitch
