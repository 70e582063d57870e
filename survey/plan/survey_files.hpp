#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sample.hpp"
#include "mapper/geometry/sound_ray.hpp"
#include "survey/plan/survey_plan.hpp"
#include "survey/read/sample_queue.hpp"
#include "survey/read/sample_source.hpp"

namespace seastitch {

class SurveyStream;

// Reads survey files, and makes samples of their records as drivers would: navigation of an INS,
// depth, pings or placed soundings, sound speed. The records of all files are merged in order of
// time; of each file the records of kReorderS are buffered to sort them. A file is open from its
// first ping or navigation record to its end.
//
// Attitude is rotated to the vehicle's axes. Depth is that of the plan's p_vehicle_depth_m. Height
// is that of the point whose position is given.
class SurveyFiles : public SampleSource {
 public:
  static constexpr double kReorderS = 15.0;

  // Detected by the content of the file, or by its name for a format without a signature.
  static bool IsSurveyFile(const std::filesystem::path& path);

  explicit SurveyFiles(SurveyPlan plan);
  ~SurveyFiles() override;

  const SurveyPlan& plan() const { return plan_; }
  // See SurveyPlan. Before the first record.
  void UseGridOrigin(const Eigen::Vector2d& north_east_m) { plan_.UseGridOrigin(north_east_m); }
  // Callback for every ping that the sonar's software has placed, used or not.
  void OnPlacedPing(std::function<void(const PlacedPing&)> callback) {
    on_placed_ping_ = std::move(callback);
  }

  std::optional<Received> Next() override;
  std::size_t input() const override { return file_; }
  int percent_read() const override { return static_cast<int>(100 * bytes_read() / bytes()); }
  Counters refused() const override { return counters(); }
  std::vector<Condition> conditions() const override { return samples_.Faults(); }
  // Time of the last record; does not decrease.
  Time now() const { return now_; }
  std::uint64_t bytes() const;
  std::uint64_t bytes_read() const;
  // Counters of the readers, and survey_pings, survey_pings_repeated (read twice, used once),
  // survey_pings_not_used (soundings beside raw pings of other files),
  // survey_pings_without_attitude, survey_pings_without_position,
  // survey_positions_of_another_source, survey_attitudes_of_another_source,
  // survey_attitude_without_heading; and malformed samples.
  // Pings given so far.
  std::int64_t pings() const { return pings_; }
  Counters counters() const;
  // Those of the plan, and what reading has found.
  const std::vector<MapWarning>& warnings() const { return warnings_; }
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
    std::int64_t Uncovered(double hold_s) const;
  };
  // Decides between the chosen source of the plan and others. Another one is used while the chosen
  // one is silent: with navigation beside the files after a minute, which may be its interval.
  struct Choice {
    std::optional<Time> chosen_time{};  // of its last record
    std::string substitute{};           // source of the last record of another one
    Time substitute_time{};

    bool Uses(const NavigationRecord& record, const std::string& chosen);
  };
  struct Use;
  struct Turn {
    Time time;
    double heading_rad;
  };

  struct Input {
    PlannedFile file;
    std::uint64_t bytes;
    std::unique_ptr<SurveyStream> stream{};  // while the file is read
  };
  // What distinguishes a ping from the others of the same time.
  struct PingId {
    std::uint8_t head;
    std::uint32_t number;
    double sum;  // of its travel times, or of its depths
    bool operator==(const PingId&) const = default;
  };

  bool ReadNext();
  Input* Earliest();
  void Open(Input* input);
  void CloseIfEnded(Input* input);
  bool IsRepeated(Time t, const PingId& id);
  bool UsesPosition(const NavigationRecord& record);
  bool UsesAttitude(const NavigationRecord& record);
  GeoPosition AtChosenPoint(const NavigationRecord& record) const;
  void OnNavigation(const NavigationRecord& record);
  std::optional<GeoVelocity> VelocityAtPosition(Time t);
  void OnAttitude(Time t, const Attitude& attitude, const NavigationRecord& record);
  void AddLevel(Time t);
  void OnHeading(Time t, double heading_rad);
  void OnPing(const MbesPing& ping);
  void OnPlaced(const PlacedPing& ping);
  void OnDepthOfPing(const PlacedPing& ping);
  void PutDepth(Time t, double depth_m);
  void PutWaterLine(Time t, double height_m);

  SurveyPlan plan_;
  double water_line_m_;  // z of the water line in vehicle axes, by the last installation
  std::vector<Input> inputs_;
  std::vector<Input*> waiting_;  // not yet open; the last one begins first
  std::vector<Input*> open_;
  std::size_t file_ = 0;
  Time now_;
  SampleQueue samples_;  // of the last record
  std::int64_t pings_ = 0;
  Counters counters_;
  std::vector<MapWarning> warnings_;
  std::uint64_t bytes_closed_ = 0;  // of the files that are read to their end
  Time ping_time_;
  std::vector<PingId> pings_at_time_;
  std::deque<NavigationRecord> levels_;  // roll and pitch, until a heading comes
  std::optional<Turn> heading_;
  Choice position_choice_;
  Choice attitude_choice_;
  std::optional<GeoVelocity> velocity_;
  Time velocity_time_;
  std::string velocity_source_;
  std::optional<Eigen::Quaterniond> q_ned_vehicle_;  // the last
  struct Lever {
    Time time;
    std::string source;  // of the velocity
    Eigen::Vector3d p_ned_m;
  };
  std::optional<Lever> lever_;  // at the last position, from the velocity's point to the position's
  std::optional<double> depth_m_;  // the last
  Time depth_time_;
  std::vector<SoundVelocityProfile> profiles_;  // of the plan, until the first record
  std::optional<RayTracer> rays_;               // of the last profile
  std::function<void(const PlacedPing&)> on_placed_ping_;
  Coverage attitude_{.max_gap_s = 1.0};
  Coverage position_{.max_gap_s = 2.0};
  Coverage chosen_position_{.max_gap_s = 60.0};  // of plan_.position_source alone
};

}  // namespace seastitch
