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

// Content of the heads of the files: the sensors to use, and their mounting.
struct SurveyPlan {
  std::string position_source;  // NavigationRecord::source; empty: there is none
  std::string attitude_source;
  // As attitude_source, of sensors that give roll and pitch in one record and heading in another.
  std::string heading_source;
  std::string heave_source;  // where the depth is made of heave
  std::string depth_source;  // where it is the navigation's own
  // Of the depth: the heave of the attitude source, with the water line; the navigation's own; or
  // what the sonar states with each ping.
  enum class Depth { kNone, kHeave, kNavigation, kPing } depth = Depth::kNone;
  bool raw_pings = false;        // times and angles; else soundings as they were placed
  bool soundings = false;        // there is either
  double depth_m = 0.0;          // of the seabed under the sonar, in the middle
  double max_range_m = 0.0;      // from the sonar to the furthest sounding
  double ping_interval_s = 0.0;  // in the middle
  bool grid = false;             // positions are of a map grid without a name
  SonarInstallation installation;
  bool has_installation = false;
  VehicleGeometry vehicle;  // T_vehicle_imu: of the position source, in the vehicle's axes

  // Some lines for people.
  std::string Text() const;
};

// Survey files of any format as the messages that drivers would have published: INS, DEPTH,
// MBES_PING or MBES_SOUNDINGS, SVP. All files are read side by side, in order of time; each is held
// for kReorderS of its records and no more.
//
// Attitude is turned into the vehicle's axes; DEPTH is that of the vehicle's reference point,
// height that of the place that positions are of.
class SurveyFiles {
 public:
  static constexpr double kReorderS = 15.0;

  // Known by its content, or by its name where that has no mark.
  static bool IsSurveyFile(const std::filesystem::path& path);

  // Reads the heads of the files. Throws DataError naming the file that cannot be read.
  explicit SurveyFiles(const std::vector<std::filesystem::path>& files);
  ~SurveyFiles();

  const SurveyPlan& plan() const { return plan_; }
  // Why nothing can be mapped, by the heads of the files: one line; absent: it can.
  std::optional<std::string> Problem() const;

  // Publishes what the next record holds. False: no record was left.
  bool PublishNext(Bus* bus);
  // The file of the last record, by number from 0.
  std::size_t file() const { return file_; }
  // Time of the last record; never falls.
  Time now() const { return now_; }
  std::uint64_t bytes() const;
  std::uint64_t bytes_read() const;
  // Of the readers, and: survey_pings, survey_pings_without_attitude,
  // survey_pings_without_position.
  Counters counters() const;
  // After the last record: why nothing of it can be mapped.
  std::optional<std::string> Outcome() const;

 private:
  // Pings that lie between two samples of a sensor that are too far apart.
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
  std::deque<NavigationRecord> levels_;  // roll and pitch that wait for a heading
  std::optional<Turn> heading_;
  std::optional<GivenVelocity> velocity_;
  Time velocity_time_;
  std::optional<Eigen::Quaterniond> q_ned_vehicle_;  // the last
  std::optional<double> depth_m_;
  Coverage attitude_{.max_gap_s = 1.0};
  Coverage position_{.max_gap_s = 2.0};
};

}  // namespace seastitch
