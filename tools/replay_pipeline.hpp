#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "common/runtime/bus.hpp"
#include "common/runtime/worker.hpp"
#include "mapper/mapper_node.hpp"
#include "optimizer/optimizer_node.hpp"
#include "products/report/dive_report.hpp"
#include "products/survey_collector.hpp"
#include "tools/finished_map.hpp"
#include "tools/replay_config.hpp"

namespace seastitch {

// Hands what mapper and optimizer publish to the collector.
class CollectorNode {
 public:
  CollectorNode(Bus* bus, SurveyCollector* collector);
  CollectorNode(const CollectorNode&) = delete;
  CollectorNode& operator=(const CollectorNode&) = delete;

 private:
  SurveyCollector* collector_;
  SubmapAssembler submaps_;
  PoseGraphAssembler graphs_;
};

// Mapper and optimizer on a private bus; messages are handled one after the other.
class Pipeline {
 public:
  Pipeline(const ReplayConfig& config,
           const MapperConfig& mapper,
           Bus* bus,
           std::function<bool()> stopped,
           MapRecorder* recorder);
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  MapperNode& mapper() { return mapper_; }
  // Adds a submap and settles.
  void AddSubmap(Submap submap, Mapper::OfDive of_dive);
  // Handles messages until all are answered and no pair is left for a retry.
  void Settle();
  void Finish();
  // The mapper's HEALTH sentence and all counters that are not zero.
  std::string Statement();

 private:
  Bus* bus_;
  std::function<bool()> stopped_;
  InlineWorker worker_;
  MapperNode mapper_;
  OptimizerNode optimizer_;
};

// Counters that are not zero.
std::map<std::string, std::int64_t> CountersOf(MapperNode* mapper);
// Sentences of the faults that are present. A dive of several has no optimizer of its own.
std::vector<std::string> ConditionsOf(MapperNode* mapper);
DiveReport ReportOf(MapperNode* mapper);

}  // namespace seastitch
