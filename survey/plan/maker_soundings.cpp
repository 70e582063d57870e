#include "survey/plan/maker_soundings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <variant>

#include "common/core/pose.hpp"
#include "common/core/sample.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "survey/plan/survey_files.hpp"

namespace seastitch {
namespace {

// Feeds a survey's samples to the mapper's navigation and geometry, and compares ping by ping.
class Comparer {
 public:
  Comparer(const SurveyPlan& plan, int max_pings, PositionInPing position)
      : plan_(plan),
        max_pings_(max_pings),
        position_(position),
        survey_(plan),
        navigation_(InsNavigationParams{}, NavigationParams{}, plan.vehicle) {
    survey_.OnPlacedPing([this](const PlacedPing& p) { placed_.emplace(IdOf(p), p); });
  }

  SoundingComparison Run() {
    while (heard_ < max_pings_) {
      const std::optional<Received> received = survey_.Next();
      if (!received) break;
      Use(received->sample);
      while (!pings_.empty() && navigation_.latest() > EndOf(pings_.front())) Take();
    }
    navigation_.Finish();
    while (!pings_.empty()) Take();
    return result_;
  }

 private:
  using PingId = std::tuple<Time, std::uint8_t, std::uint32_t>;
  template <class Ping>
  static PingId IdOf(const Ping& ping) {
    return {ping.time, ping.head, ping.ping_number};
  }

  void Use(const Sample& sample) {
    std::visit(Overloaded{[this](const NavigationSample& s) { navigation_.Add(s); },
                          [this](const DepthSample& s) { navigation_.Add(s); },
                          [this](const SoundVelocityProfile& p) { rays_ = RayTracer::Make(p); },
                          [this](const MbesPing& p) {
                            ++heard_;
                            pings_.push_back(p);
                          },
                          [](const auto&) {}},
               sample);
  }

  // A moment after the last echo that counts.
  static Time EndOf(const MbesPing& ping) {
    double listening_s = 0.0;
    for (const MbesBeam& beam : ping.beams)
      if (IsPlausible(beam))
        listening_s = std::max(listening_s, double{beam.tx_delay_s} + double{beam.twtt_s});
    return ping.time + FromSeconds(listening_s + 0.1);
  }

  void Take() {
    const MbesPing ping = pings_.front();
    pings_.pop_front();
    const auto placed = placed_.extract(IdOf(ping));
    if (placed.empty() || !rays_ || !placed.mapped().origin_depth_m) return;
    const auto state_at_ping = navigation_.StateAt(ping.time);
    if (!state_at_ping) return;
    const Eigen::Vector3d p_map = state_at_ping->T_map_vehicle.translation();
    const auto pose_at = [this, &p_map](Time t) -> std::optional<Eigen::Isometry3d> {
      std::optional<NavState> state = navigation_.StateAt(t);
      if (!state) return std::nullopt;
      if (position_ == PositionInPing::kHeld)
        state->T_map_vehicle.translation().head<2>() = p_map.head<2>();
      return state->T_map_vehicle;
    };
    if (const auto ours = Georeference(ping, pose_at, plan_.vehicle, *rays_))
      Compare(*ours, placed.mapped());
  }

  void Compare(const GeoreferencedPing& ours, const PlacedPing& theirs) {
    ++result_.pings;
    const Eigen::Matrix3d level_from_map =
        LevelFromBody(ours.T_map_vehicle) * ours.T_map_vehicle.linear().transpose();
    const Eigen::Vector3d p_level_origin =
        LevelFromBody(ours.T_map_vehicle) * theirs.p_vehicle_origin_m;
    for (const Sounding& sounding : ours.soundings) {
      const auto i = static_cast<std::size_t>(sounding.beam);
      if (i >= theirs.soundings.size() || (theirs.soundings[i].flags & kBeamValid) == 0) continue;
      const Eigen::Vector3d p_theirs = theirs.soundings[i].p_level_m.cast<double>();
      const double depth_m = p_theirs.z() + *theirs.origin_depth_m;
      // A sonar that places no soundings fills in zeros.
      if (p_theirs.isZero() || !(depth_m > 0.1)) continue;
      Eigen::Vector3d off = level_from_map * (sounding.p_map - ours.T_map_vehicle.translation()) -
                            p_level_origin - p_theirs;
      off.z() = sounding.p_map.z() - depth_m;
      result_.residuals.push_back({std::atan2(p_theirs.y(), p_theirs.z()), 100.0 / depth_m * off});
    }
  }

  const SurveyPlan plan_;
  const int max_pings_;
  const PositionInPing position_;
  SurveyFiles survey_;
  InsNavigation navigation_;
  std::optional<RayTracer> rays_;
  std::deque<MbesPing> pings_;
  std::multimap<PingId, PlacedPing> placed_;  // the swaths of one ping share its number and time
  int heard_ = 0;                             // pings
  SoundingComparison result_;
};

std::string Percent(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f %%", value);
  return text;
}

// A plan, and how far its soundings are from the sonar's own: RMS over all axes, percent of depth.
struct Trial {
  SurveyPlan plan;
  double percent;
};

// The sound speed that agrees better. Nothing: too few soundings of the sonar to compare with.
std::optional<Trial> WithSoundSpeed(SurveyPlan plan) {
  constexpr int kPings = 50;
  constexpr int kLeastBeams = 100;
  // Where both fit about as well, they differ by nothing that counts.
  constexpr double kClearly = 0.5;
  SurveyPlan alone = plan;
  alone.profile_alone = true;
  const SoundingComparison probe = CompareWithMaker(plan, kPings);
  const SoundingComparison profile = CompareWithMaker(alone, kPings);
  if (probe.beams() < kLeastBeams || profile.beams() < kLeastBeams) return std::nullopt;
  const double probe_percent = probe.RmsPercent().norm();
  const double profile_percent = profile.RmsPercent().norm();
  plan.profile_alone = profile_percent < kClearly * probe_percent;
  const double better = plan.profile_alone ? profile_percent : probe_percent;
  const double worse = plan.profile_alone ? probe_percent : profile_percent;
  plan.sound_speed_text =
      std::string("sound speed: ") +
      (plan.profile_alone ? "the profile alone" : "at the transducer, then the profile") +
      "; against the sonar's own soundings " + Percent(better) + " of depth RMS (" +
      (plan.profile_alone ? "with that at the transducer" : "with the profile alone") + ": " +
      Percent(worse) + ")\n";
  return Trial{std::move(plan), better};
}

}  // namespace

Eigen::Vector3d SoundingComparison::RmsPercent(double from_deg, double to_deg) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int n = 0;
  for (const SoundingResidual& r : residuals)
    if (Rad2Deg(r.angle_rad) >= from_deg && Rad2Deg(r.angle_rad) < to_deg)
      sum += r.percent_of_depth.cwiseAbs2(), ++n;
  return (sum / std::max(n, 1)).cwiseSqrt();
}

SoundingComparison CompareWithMaker(const SurveyPlan& plan,
                                    int max_pings,
                                    PositionInPing position) {
  if (!plan.raw_pings || plan.Problem()) return {};
  return Comparer(plan, max_pings, position).Run();
}

SurveyPlan PlanSurvey(const std::vector<std::filesystem::path>& files,
                      bool mounting_is_given,
                      const ProfileChoice& profiles) {
  // Real files with a known installation fit to 0.3 %.
  constexpr double kFitsPercent = 1.0;
  const SurveyPlan plan = MakeSurveyPlan(files, profiles);
  std::optional<Trial> best = WithSoundSpeed(plan);
  if (!best) return plan;
  const bool unknown_mounting = mounting_is_given && !plan.has_installation;
  if (best->percent < kFitsPercent || unknown_mounting) return best->plan;
  const double first_percent = best->percent;
  if (plan.depth != SurveyPlan::Depth::kPing) {
    const std::optional<Trial> by_ping = WithSoundSpeed(plan.WithDepthOfPings());
    if (by_ping && by_ping->percent < best->percent) best = by_ping;
    if (best->percent < kFitsPercent) {
      best->plan.warnings.push_back(
          {WarningCode::kDepthOfPings,
           "depth: that of the sonar for each ping, because the other is " +
               Percent(first_percent) + " of depth off its soundings"});
      return best->plan;
    }
  }
  SurveyPlan placed = plan.WithPlacedSoundings();
  placed.warnings.push_back(
      {WarningCode::kSonarsOwnSoundings,
       "the sonar's own soundings are used, because those from raw times and angles are " +
           Percent(best->percent) + " of depth off them: is the installation known?"});
  return placed;
}

}  // namespace seastitch
