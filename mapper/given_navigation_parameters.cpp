// The key navigation_source and the section `given_navigation` of config/mapper.yaml.

#include "mapper/mapper_config.hpp"

namespace seastitch {

void DeclareGivenNavigation(MapperParams* params, ParameterTable* table) {
  using enum Unit;
  table
      ->AddChoice<NavigationSource>(
          "navigation_source",
          &params->navigation_source,
          {{"dead_reckoning", NavigationSource::kDeadReckoning},
           {"given", NavigationSource::kGiven}},
          "dead_reckoning: computed here from IMU, DVL and DEPTH. given: the poses on INS, from an "
          "INS that navigates by itself or from survey files.")
      .DataSheet();
  ParameterTable& section = table->AddSection(
      "given_navigation", "The INS's data sheet, where navigation_source is given.");
  GivenNavigationParams* const p = &params->given_navigation;
  section
      .Add("heading_sigma_deg",
           &p->heading_rad,
           kDegreeFromRadian,
           Range::AtLeast(0.0).Below(180.0),
           "Error of its heading that stays, 1 sigma. Where a sample states its own sigma, that is "
           "divided into staying and wandering as these two are.")
      .DataSheet();
  section
      .Add("heading_wander_deg",
           &p->heading_wander_rad.sigma,
           kDegreeFromRadian,
           Range::AtLeast(0.0).Below(180.0),
           "Error of its heading that wanders, 1 sigma.")
      .DataSheet();
  section.Add("heading_wander_tau_s",
              &p->heading_wander_rad.tau_s,
              kSecond,
              Range::Above(0.0),
              "Correlation time of it.");
  section
      .Add("distance_error_ratio",
           &p->distance_ratio,
           kNone,
           Range::AtLeast(0.0).Below(1.0),
           "Error of the distance travelled over the distance, 1 sigma: 0.001 is 0.1 %.")
      .DataSheet();
  section
      .Add(
          "random_walk_m_per_sqrt_m",
          &p->random_walk_m_per_rtm,
          kNone,
          Range::AtLeast(0.0),
          "Random walk of the position, each axis, over the square root of the way in metres: 0.02 "
          "are 0.6 m in 1 km.")
      .DataSheet();
  section
      .Add("position_sigma_m",
           &p->position_sigma_m,
           kMetre,
           Range::Above(0.0),
           "Of its position where the vehicle starts or a fix was taken, 1 sigma, where the sample "
           "states none.")
      .DataSheet();
  section
      .Add("uses_position_fixes",
           &p->uses_position_fixes,
           "True: GPS, USBL or beacons correct it all the time; its position is then as good "
           "everywhere. False: it reckons, and a fix now and then shows as a jump.")
      .DataSheet();
  section.Add("min_jump_m",
              &p->min_jump_m,
              kMetre,
              Range::Above(0.0),
              "A jump of the position against its own velocity is taken out of the track and given "
              "to the graph as a fix. Smaller ones are taken for motion.");
}

}  // namespace seastitch
