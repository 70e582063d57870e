#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "common/runtime/stage.hpp"
#include "products/survey.hpp"

namespace seastitch {

struct SurveyCollectorOptions {
  // Minimum time between two stored states of the track. NAV at 50 Hz has no more information than
  // at 10 Hz.
  double track_interval_s = 0.05;
  std::string Validate() const;
};

// Collects the output of mapper and optimizer into a Survey. Points are written to
// DIR/submaps/submap_ID.pcd by a thread of its own. Memory: some 100 bytes per corner of a
// footprint and 56 bytes per state of the track. Unusable input (repeated, not finite, out of
// order) is counted in Survey::counters and left out.
class SurveyCollector {
 public:
  // Creates DIR/submaps. Throws std::runtime_error naming the folder.
  explicit SurveyCollector(std::filesystem::path dir, SurveyCollectorOptions options = {});

  // Begins the next of several dives: everything added from now on belongs to it.
  void BeginDive(const std::string& name);
  // Throws std::runtime_error where a file cannot be written, this one's or one before.
  void Add(const Submap& submap);
  void Add(const NavState& state);
  void Add(TrackState state);          // of the dive that began last, whatever its `chain`
  void Add(const SmoothedPose& pose);  // of the dive that began last
  void Add(const CorrectedNavState& corrected);
  void Add(const GraphUpdate& update);
  void Add(const PoseGraph& graph);

  std::size_t states() const { return track_.size(); }  // of the track
  std::size_t submaps() const { return submaps_.size(); }
  // Waits for the clouds. Throws as Add().
  Survey Finish();

 private:
  // A submap whose cloud is to be written: beside what goes on.
  struct Unwritten {
    SurveySubmap* kept;  // of submaps_
    PointCloud cloud;
  };
  static void Write(const Unwritten& submap);
  static constexpr std::size_t kMostUnwritten = 2;

  void AddEarlier(const TrackState& state);
  std::int32_t Chain() const;
  std::filesystem::path submap_dir_;
  SurveyCollectorOptions options_;
  std::map<SubmapId, SurveySubmap> submaps_;
  std::vector<TrackState> track_;
  std::vector<TrackState> earlier_;  // states in a row from before the end of track_
  std::map<std::int32_t, std::vector<SmoothedPose>> smoothed_;  // by chain
  std::vector<PublishedState> published_;
  std::vector<std::string> dives_;
  std::map<SubmapId, std::int32_t> chains_;
  std::map<std::int64_t, std::vector<GraphEdge>> edges_by_version_;
  PoseGraph solution_;
  std::map<std::string, std::uint64_t> counters_;
  Stage<Unwritten> clouds_{Write, kMostUnwritten};  // last: its thread uses submaps_
};

}  // namespace seastitch
