// The section `given_navigation` of config/mapper.yaml.

#include "mapper/navigation/ins/ins_navigation.hpp"

namespace seastitch {

void DeclareInsNavigation(InsNavigationParams* p, ParameterTable* table) {
  using enum Unit;
  ParameterTable& section = table->AddSection("given_navigation",
                                              "Errors of the poses on channel INS (the system's "
                                              "data sheet), where navigation_source is given.");
  section
      .Add("heading_sigma_deg",
           &p->heading_rad,
           kDegreeFromRadian,
           Range::AtLeast(0.0).Below(180.0),
           "Constant error of the system's heading, 1 sigma. A sigma that a sample states is split "
           "between constant and wandering error in the ratio of this to heading_wander_deg.")
      .DataSheet();
  section
      .Add("heading_wander_deg",
           &p->heading_wander_rad.sigma,
           kDegreeFromRadian,
           Range::AtLeast(0.0).Below(180.0),
           "Wandering error of the system's heading, 1 sigma.")
      .DataSheet();
  section.Add("heading_wander_tau_s",
              &p->heading_wander_rad.tau_s,
              kSecond,
              Range::Above(0.0),
              "Correlation time of heading_wander_deg.");
  section
      .Add("distance_error_ratio",
           &p->distance_ratio,
           kNone,
           Range::AtLeast(0.0).Below(1.0),
           "Error of the distance travelled divided by the distance, 1 sigma: 0.001 is 0.1 %.")
      .DataSheet();
  section
      .Add("random_walk_m_per_sqrt_m",
           &p->random_walk_m_per_rtm,
           kNone,
           Range::AtLeast(0.0),
           "Random walk of the position, each axis, 1 sigma divided by the square root of the "
           "distance travelled: 0.02 is 0.6 m in 1 km.")
      .DataSheet();
  section
      .Add("position_sigma_m",
           &p->position_sigma_m,
           kMetre,
           Range::Above(0.0),
           "Uncertainty of the system's position at the start and at its position fixes, 1 sigma, "
           "for samples that state none.")
      .DataSheet();
  section
      .Add("uses_position_fixes",
           &p->uses_position_fixes,
           "True: GPS, USBL or beacons correct the system all the time; its position is then "
           "equally good everywhere. False: it dead reckons, and an occasional fix shows as a jump "
           "of its position.")
      .DataSheet();
  section
      .Add(
          "follow_velocity",
          &p->follow_velocity,
          "True: the track follows the system's velocity, and whatever else its position does is a "
          "correction of the system: for one that corrects its position all the time. False: the "
          "track follows the position, apart from jumps: for velocities of GPS, and all that lag.")
      .DataSheet();
  section.Add(
      "min_jump_m",
      &p->min_jump_m,
      kMetre,
      Range::Above(0.0),
      "Smallest jump of the position, inconsistent with the system's own velocity, that is taken "
      "out of the track and given to the graph as a fix. A smaller one counts as motion.");
}

}  // namespace seastitch
