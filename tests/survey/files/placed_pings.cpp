#include "tests/survey/files/placed_pings.hpp"

#include <deque>
#include <optional>
#include <utility>

#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "survey/errors.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_files.hpp"
#include "tests/survey/files/read_all.hpp"

namespace seastitch {
namespace {

// Places pings of either kind as soon as navigation has passed them.
class Placer {
 public:
  explicit Placer(const VehicleGeometry& vehicle)
      : vehicle_(vehicle), navigation_({}, {}, vehicle) {}

  template <class Sample>
  void Navigate(const Sample& sample) {
    navigation_.Add(sample);
    while (!raw_.empty() && navigation_.latest() > LastEcho(raw_.front()) + FromSeconds(0.1))
      PlaceRaw();
    while (!given_.empty() && navigation_.latest() > given_.front().time) PlaceGiven();
  }
  void Add(const SoundVelocityProfile& profile) { rays_ = RayTracer::Make(profile); }
  void Add(const MbesPing& ping) { raw_.push_back(ping); }
  void Add(const SoundingPing& ping) { given_.push_back(ping); }

  std::vector<PlacedSoundings> Finish() {
    navigation_.Finish();
    while (!raw_.empty()) PlaceRaw();
    while (!given_.empty()) PlaceGiven();
    return std::move(placed_);
  }

 private:
  void PlaceRaw() {
    const MbesPing ping = std::move(raw_.front());
    raw_.pop_front();
    const auto pose_at = [this](Time t) -> std::optional<Eigen::Isometry3d> {
      const std::optional<NavState> state = navigation_.StateAt(t);
      return state ? std::optional(state->T_map_vehicle) : std::nullopt;
    };
    const RayTracer rays = rays_ ? *rays_ : RayTracer::Constant(ping.sound_speed_mps);
    if (const auto placed = Georeference(ping, pose_at, vehicle_, rays)) Keep(ping.time, *placed);
  }
  void PlaceGiven() {
    const SoundingPing ping = std::move(given_.front());
    given_.pop_front();
    if (const auto state = navigation_.StateAt(ping.time))
      Keep(ping.time, Georeference(ping, state->T_map_vehicle));
  }
  void Keep(Time time, const GeoreferencedPing& ping) {
    PlacedSoundings& placed = placed_.emplace_back();
    placed.time = time;
    for (const Sounding& sounding : ping.soundings) placed.p_map_m.push_back(sounding.p_map);
  }

  const VehicleGeometry vehicle_;
  InsNavigation navigation_;
  std::optional<RayTracer> rays_;
  std::deque<MbesPing> raw_;
  std::deque<SoundingPing> given_;
  std::vector<PlacedSoundings> placed_;
};

}  // namespace

PlacedSurvey PlaceSurvey(const std::vector<std::filesystem::path>& files) {
  const SurveyPlan plan = PlanSurvey(files);
  if (const auto problem = plan.Problem()) throw DataError(*problem);
  PlacedSurvey placed{.text = plan.Text(),
                      .counters = {},
                      .datum_latitude_deg = Rad2Deg(plan.vehicle.datum.latitude_rad),
                      .datum_longitude_deg = Rad2Deg(plan.vehicle.datum.longitude_rad),
                      .pings = {}};
  SurveyFiles survey(plan);
  Placer placer(plan.vehicle);
  ReadAll(
      &survey,
      [&](const NavigationSample& sample) { placer.Navigate(sample); },
      [&](const DepthSample& sample) { placer.Navigate(sample); },
      [&](const SoundVelocityProfile& profile) { placer.Add(profile); },
      [&](const MbesPing& ping) { placer.Add(ping); },
      [&](const SoundingPing& ping) { placer.Add(ping); });
  placed.pings = placer.Finish();
  if (const auto outcome = survey.Outcome()) throw DataError(*outcome);
  placed.counters = survey.counters();
  return placed;
}

}  // namespace seastitch
