#include <cmath>
#include <cstdio>

#include "common/core/pose.hpp"
#include "common/core/survey_noise.hpp"
#include "mapper/mapper.hpp"
#include "mapper/submaps/losses.hpp"

// What HEALTH and people are told of a mapper: faults, counters, one line.
namespace seastitch {
namespace {

// Time without NAV that is reported [s].
constexpr double kNoNavS = 2.0;
constexpr double kNoOptimizerS = 10.0;  // it may be started later than the mapper
constexpr double kNoSolutionS = 60.0;   // that a solution may take

const char* Sentence(SoundSpeed::Source source) {
  switch (source) {
    case SoundSpeed::Source::kProfile: return "sound speed from a profile";
    case SoundSpeed::Source::kConfigured: return "sound speed from the configured profile";
    case SoundSpeed::Source::kTransducer: return "sound speed from the transducer alone";
    case SoundSpeed::Source::kAssumed: return "sound speed assumed";
  }
  return "";
}

std::string Sentence(const Judgement& harm) {
  char text[200];
  if (harm.torn)
    std::snprintf(text,
                  sizeof text,
                  "it would tear the map apart (%zu cells seen twice in place of %zu by dead "
                  "reckoning)",
                  harm.cells_solved,
                  harm.cells_dead_reckoned);
  else
    std::snprintf(text,
                  sizeof text,
                  "it would make the map less consistent than dead reckoning (%.3f m in place of "
                  "%.3f m)",
                  harm.solved_m,
                  harm.dead_reckoned_m);
  return text;
}

}  // namespace

std::vector<Condition> Mapper::conditions() const {
  std::vector<Condition> now;
  if (const auto& harm = search_.harm())
    now.push_back({&conditions::kSolutionWithheld, Sentence(*harm)});
  if (const std::optional<double> turned_rad = dvl_turned_rad()) {
    char text[40];
    std::snprintf(text, sizeof text, "by %.1f deg", Rad2Deg(std::abs(*turned_rad)));
    now.push_back({&conditions::kDvlTurned, text});
  }
  if (!solution_refused_.empty())
    now.push_back({&conditions::kSolutionsRefused, solution_refused_});
  const bool given = params_.navigation_source == NavigationSource::kGiven;
  const std::vector<Condition> of_navigation =
      given ? ins_monitor_.conditions(*navigation_) : watch_.conditions(*navigation_);
  now.insert(now.end(), of_navigation.begin(), of_navigation.end());
  const std::vector<Condition> of_clocks = clocks_.conditions();
  now.insert(now.end(), of_clocks.begin(), of_clocks.end());
  const std::vector<Condition> of_pings = ping_watch_.conditions();
  now.insert(now.end(), of_pings.begin(), of_pings.end());
  if (const std::optional<double> behind_s = rewind_.behind_s()) {
    char text[40];
    std::snprintf(text, sizeof text, "by %.0f s", *behind_s);
    now.push_back({&conditions::kTimeWentBack, text});
  }
  if (nav_came_at_ && ToSeconds(*clocks_.newest() - *nav_came_at_) > kNoNavS)
    now.push_back({&conditions::kNoNavigation, "since " + UtcOf(*last_nav_)});
  if (navigation_->starts_from_fix() && fixes_in_graph_ == 1)
    now.push_back({&conditions::kPlaceFromOneFix, ""});
  if (vertical_.IsMissed()) now.push_back({&conditions::kNoWaterLevel, ""});
  const bool is_silent = clocks_.health_time_s() - optimizer_heard_s_ > kNoOptimizerS;
  const bool is_late =
      unsolved_since_s_ && clocks_.health_time_s() - *unsolved_since_s_ > kNoSolutionS;
  if ((is_silent || is_late) && search_.solution_version() < graph_.version())
    now.push_back({&conditions::kNoOptimizer,
                   "solved up to version " + std::to_string(search_.solution_version()) + " of " +
                       std::to_string(graph_.version())});
  if (sound_speed_source_ && !SoundSpeed::IsProfile(*sound_speed_source_))
    now.push_back({&conditions::kNoSoundSpeedProfile, Sentence(*sound_speed_source_)});
  if (failed_in_last_job_ > 0)
    now.push_back({&conditions::kRegistrationFailed, std::to_string(failed_in_last_job_)});
  return now;
}

std::optional<double> Mapper::dvl_turned_rad() const {
  // What the graph finds beyond it may be the sonar's angle: it alone names no log.
  const double by_navigation_rad = navigation_->dvl_yaw_rad();
  if (std::abs(by_navigation_rad) <= kAdviceSigmas * params_.navigation.dvl_mounting_rad.sigma)
    return std::nullopt;
  return by_navigation_rad + search_.MountingOf(OwnChain().number).dvl_yaw_rad;
}

std::string Mapper::WaitsFor() const {
  return "waiting for navigation: " + Explain(navigation_->start_state());
}

Counters Mapper::counters() const {
  Counters all = counters_;
  for (const auto& [name, count] : navigation_->counters()) all["nav_" + name] = count;
  pings_lost().AddTo(&all);
  for (const auto& [name, count] : builder_.counters()) all[name] = count;
  const PingPlacer::Tally placed = placer_.tally();
  all["beams_read"] = placed.beams_read;
  all["beams_invalid"] = placed.beams_invalid;
  all["beams_refused"] = placed.beams_refused;
  if (placed.beams_of_unknown_part > 0)
    all["beams_of_unknown_transmit_array"] = placed.beams_of_unknown_part;
  if (placed.speeds_from_profile > 0)
    all["pings_with_impossible_sound_speed"] = placed.speeds_from_profile;
  for (const auto& [name, count] : clocks_.counters()) all[name] = count;
  all["position_fixes_in_graph"] = frames_.fixes_in_graph();
  all["position_fixes_too_far"] = frames_.fixes_too_far();
  all["relative_covariances_missing"] = frames_.independent();
  all["pings_waiting"] = static_cast<std::int64_t>(pings_.size() + sounding_pings_.size());
  all["submaps_waiting"] = static_cast<std::int64_t>(submaps_.size());
  all["solution_version"] = search_.solution_version();
  all["loop_closures_accepted"] = search_.accepted();
  all["loop_closures_rejected"] = search_.rejected();
  return all;
}

std::string Mapper::Summary() const {
  Counters refused = builder_.soundings_lost();
  const PingPlacer::Tally placed = placer_.tally();
  refused["beams_refused"] = placed.beams_refused;
  const Rejection rejection = RejectionOf(placed.beams_read - placed.beams_invalid, refused);
  std::string summary = std::to_string(search_.size()) + " submaps, " +
                        std::to_string(search_.accepted()) + " loop closures accepted, " +
                        std::to_string(search_.rejected()) + " rejected, " + rejection.Text();
  if (sound_speed_source_ && SoundSpeed::IsProfile(*sound_speed_source_))
    summary += std::string("; ") + Sentence(*sound_speed_source_);
  return summary;
}

}  // namespace seastitch
