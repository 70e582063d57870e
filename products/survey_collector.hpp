#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "products/survey.hpp"

namespace seastitch {

struct SurveyCollectorOptions {
  // NAV at 50 Hz says nothing that 10 Hz does not: a state is kept this long after the one before.
  double track_interval_s = 0.05;
  std::string Validate() const;
};

// Gathers what the mapper and the optimizer publish. Points go to DIR/submaps/submap_ID.pcd as they
// come; memory holds some 100 bytes a submap corner and 56 bytes a track state. What cannot be used
// (repeated, not finite, out of order) is counted in Survey::counters and left out.
class SurveyCollector {
 public:
  // Creates DIR/submaps. Throws std::runtime_error naming the folder.
  explicit SurveyCollector(std::filesystem::path dir, SurveyCollectorOptions options = {});

  // What is added from now on is of the next of several dives.
  void BeginDive(const std::string& name);
  void Add(const Submap& submap);  // throws std::runtime_error where the file cannot be written
  void Add(const NavState& state);
  void Add(const CorrectedNavState& corrected);
  void Add(const GraphUpdate& update);
  void Add(const PoseGraph& graph);

  std::size_t states() const { return track_.size(); }  // of the track
  std::size_t submaps() const { return submaps_.size(); }
  Survey Finish() const;

 private:
  std::filesystem::path submap_dir_;
  SurveyCollectorOptions options_;
  std::map<SubmapId, SurveySubmap> submaps_;
  std::vector<TrackState> track_;
  std::vector<SaidState> said_;
  std::vector<std::string> dives_;
  std::map<SubmapId, std::int32_t> chains_;
  std::map<std::int64_t, std::vector<GraphEdge>> edges_by_version_;
  PoseGraph solution_;
  std::map<std::string, std::uint64_t> counters_;
};

}  // namespace seastitch
