#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/vehicle.hpp"
#include "products/warning.hpp"
#include "survey/plan/file_clocks.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {

// One file of a survey, as its head describes it.
struct PlannedFile {
  std::filesystem::path path;
  ReaderParams params{};
  // Earliest ping or navigation record; nothing: there is none.
  std::optional<Time> begin{};
  std::optional<SonarInstallation> installation{};  // the first
  std::map<std::string, ClockOffset> clocks{};      // sources that are off the sonar's clock
  std::string line_text{};              // how its soundings by line are read, for people
  bool placed_alone = false;            // it has georeferenced soundings, and no raw pings
  bool is_installed_otherwise = false;  // its installation is not the one that is used
};

// Summary of the file headers: the sensors to use, and their mounting.
struct SurveyPlan {
  std::vector<PlannedFile> files;
  std::string position_source;  // NavigationRecord::source; empty: there is none
  std::string attitude_source;
  // Source of the heading, if its records are others than those of roll and pitch; else empty.
  std::string heading_source;
  std::string heave_source;  // if depth is Depth::kHeave
  std::string depth_source;  // if depth is Depth::kNavigation
  // Source of the vehicle's depth: heave, with the water line of the file; a depth in the
  // navigation records (AUV); or a depth in each ping.
  enum class Depth { kNone, kHeave, kNavigation, kPing } depth = Depth::kNone;
  bool raw_pings = false;        // travel times and beam angles; else georeferenced soundings
  bool soundings = false;        // there are raw pings or georeferenced soundings
  double depth_m = 0.0;          // of the seabed below the sonar: median
  double max_range_m = 0.0;      // largest slant range of a sounding
  double ping_interval_s = 0.0;  // median
  // Positions are coordinates of a grid without a name; this one is at latitude and longitude 0.
  std::optional<Eigen::Vector2d> grid_origin_m;  // north, east
  SonarInstallation installation;
  bool has_installation = false;
  // T_vehicle_imu: place of the position source. p_vehicle_depth_m: point that depths are of.
  VehicleGeometry vehicle;
  // Track of the vehicle, if its attitude is not stated or too seldom: it is level, with the
  // heading of the track.
  std::shared_ptr<const LineTrack> level_track;
  Counters not_read;  // of the readers: records by the reason for which they are not read

  // The sonar has traced rays with the profile alone, without the sound speed at the transducer.
  bool profile_alone = false;
  std::string sound_speed_text;  // a line about it, if it is known
  // Profiles of files of their own, for each ping the nearest in time; not in the survey files.
  std::vector<SoundVelocityProfile> profiles;
  bool own_profiles_unused = false;  // of the survey files
  std::string profile_text;          // a line about profiles of files of their own
  std::vector<MapWarning> warnings;  // what the files do not have, and what does not fit

  // If the files cannot give a map: the reason, one line.
  std::optional<std::string> Problem() const;
  // The sensor that a source's records come from, if the installation has it; else null.
  const InstalledSensor* SensorOf(const std::string& source) const;
  // The same survey with the depth that the sonar states for each ping.
  SurveyPlan WithDepthOfPings() const;
  // The same survey with the soundings that the sonar has placed.
  SurveyPlan WithPlacedSoundings() const;
  // Latitude and longitude of a point of the grid.
  GeoPosition FromGrid(const Eigen::Vector2d& north_east_m) const;
  // Places the origin of the grid elsewhere, for a survey with others of that grid.
  void UseGridOrigin(const Eigen::Vector2d& north_east_m);
  // Point of the vehicle that a source's positions and velocities are of, from its reference point.
  Eigen::Vector3d PointOf(const std::string& source) const;
  // The names of the files for which this holds: three, and the number of the others.
  std::string NamesOf(const std::function<bool(const PlannedFile&)>& holds) const;
  // A summary of some lines, for people.
  std::string Text() const;
  std::string InstallationText() const;
};

// What the user says of sound speed profiles.
struct ProfileChoice {
  std::filesystem::path only{};                // used in place of all others; empty: none
  std::vector<std::filesystem::path> named{};  // beside the survey files, perhaps in other folders
};

// Reads the heads of the files. Throws DataError naming the file that cannot be used.
SurveyPlan MakeSurveyPlan(const std::vector<std::filesystem::path>& files,
                          const ProfileChoice& profiles = {});

}  // namespace seastitch
