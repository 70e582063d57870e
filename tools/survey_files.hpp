#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "codecs/sbet_file.hpp"
#include "codecs/survey_records.hpp"
#include "common/core/counters.hpp"
#include "common/core/vehicle.hpp"
#include "common/runtime/bus.hpp"

namespace seastitch {

class SurveyStream;

// Summary of the file headers: the sensors to use, and their mounting.
struct SurveyPlan {
  std::string position_source;  // NavigationRecord::source; empty: there is none
  std::string attitude_source;
  // Source of the heading, if its records are others than those of roll and pitch; else empty.
  std::string heading_source;
  std::string heave_source;  // if depth is Depth::kHeave
  std::string depth_source;  // if depth is Depth::kNavigation
  // Source of the vehicle's depth: heave of the attitude sensor with the waterline of the file; a
  // depth in the navigation records (AUV); or a depth in each ping.
  enum class Depth { kNone, kHeave, kNavigation, kPing } depth = Depth::kNone;
  bool raw_pings = false;        // travel times and beam angles; else georeferenced soundings
  bool soundings = false;        // there are raw pings or georeferenced soundings
  double depth_m = 0.0;          // of the seabed below the sonar: median
  double max_range_m = 0.0;      // largest slant range of a sounding
  double ping_interval_s = 0.0;  // median
  bool grid = false;             // positions are projected coordinates of an unknown CRS
  SonarInstallation installation;
  bool has_installation = false;
  VehicleGeometry vehicle;  // T_vehicle_imu: place of the position source

  // A summary of some lines, for people.
  std::string Text() const;
};

// Reads survey files and publishes their records as drivers would: INS, DEPTH, MBES_PING or
// MBES_SOUNDINGS, SVP. The records of all files are merged in order of time; of each file the
// records of kReorderS are buffered to sort them.
//
// Attitude is rotated to the vehicle's axes. DEPTH is that of the vehicle's reference point. Height
// is that of the point whose position is given.
class SurveyFiles {
 public:
  static constexpr double kReorderS = 15.0;

  // Detected by the content of the file, or by its name for a format without a signature.
  static bool IsSurveyFile(const std::filesystem::path& path);

  // Reads the file headers. Throws DataError naming the file that cannot be read.
  explicit SurveyFiles(const std::vector<std::filesystem::path>& files);
  ~SurveyFiles();

  const SurveyPlan& plan() const { return plan_; }
  // Call it before reading. If the files cannot give a map: the reason, one line.
  std::optional<std::string> Problem() const;

  // Publishes the next record. False: there was none.
  bool PublishNext(Bus* bus);
  // The file of the last record, by number from 0.
  std::size_t file() const { return file_; }
  // Time of the last record; does not decrease.
  Time now() const { return now_; }
  std::uint64_t bytes() const;
  std::uint64_t bytes_read() const;
  // Counters of the readers, and survey_pings, survey_pings_without_attitude,
  // survey_pings_without_position.
  Counters counters() const;
  // Call it after the last record. If no ping can be mapped: the reason, one line.
  std::optional<std::string> Outcome() const;

 private:
  // Counts the pings in gaps of a sensor: between two samples more than max_gap_s apart.
  struct Coverage {
    double max_gap_s = 1.0;
    std::optional<Time> last{};
    std::deque<Time> pings{};  // since the last sample
    std::int64_t uncovered = 0;

    void AddPing(Time t) { pings.push_back(t); }
    void AddSample(Time t, double hold_s);
  };
  struct Publish;
  struct Turn {
    Time time;
    double heading_rad;
  };

  void Plan(const std::vector<std::filesystem::path>& files);
  void OnNavigation(const NavigationRecord& record, Bus* bus);
  void OnAttitude(Time t, const Attitude& attitude, const NavigationRecord& record, Bus* bus);
  void OnHeading(Time t, double heading_rad, Bus* bus);
  void OnPing(const MbesPing& ping, Bus* bus);
  void OnPlaced(const PlacedPing& ping, Bus* bus);
  void PublishIns(const NavigationSample& sample, Bus* bus);
  void PublishDepth(Time t, double depth_m, Bus* bus);
  void PublishWaterLine(Time t, double height_m, Bus* bus);

  std::vector<std::filesystem::path> files_;
  std::vector<std::unique_ptr<SurveyStream>> streams_;
  std::map<std::filesystem::path, SbetParams> sbets_;
  SurveyPlan plan_;
  std::size_t file_ = 0;
  Time now_;
  std::map<std::string, std::int64_t> seqs_;
  Counters counters_;
  std::deque<NavigationRecord> levels_;  // roll and pitch, until a heading comes
  std::optional<Turn> heading_;
  std::optional<GivenVelocity> velocity_;
  Time velocity_time_;
  std::optional<Eigen::Quaterniond> q_ned_vehicle_;  // the last
  std::optional<double> depth_m_;
  Coverage attitude_{.max_gap_s = 1.0};
  Coverage position_{.max_gap_s = 2.0};
};

}  // namespace seastitch
