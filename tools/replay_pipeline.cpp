#include "tools/replay_pipeline.hpp"

#include <utility>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/conditions.hpp"
#include "optimizer/optimizer_config.hpp"

namespace seastitch {

CollectorNode::CollectorNode(Bus* bus, SurveyCollector* collector) : collector_(collector) {
  bus->Subscribe<nav_t>(channels::kNav, 0, [this](const nav_t& msg) {
    if (const auto state = FromLcm(msg)) collector_->Add(*state);
  });
  bus->Subscribe<nav_corrected_t>(channels::kNavCorrected, 0, [this](const nav_corrected_t& msg) {
    if (const auto corrected = FromLcm(msg)) collector_->Add(*corrected);
  });
  bus->Subscribe<submap_t>(channels::kSubmap, 0, [this](const submap_t& msg) {
    if (const auto submap = submaps_.Add(msg)) collector_->Add(*submap);
  });
  bus->Subscribe<submap_points_t>(channels::kSubmapPoints, 0, [this](const submap_points_t& msg) {
    if (const auto submap = submaps_.Add(msg)) collector_->Add(*submap);
  });
  bus->Subscribe<graph_update_t>(channels::kGraphUpdate, 0, [this](const graph_update_t& msg) {
    if (const auto update = FromLcm(msg)) collector_->Add(*update);
  });
  bus->Subscribe<pose_graph_t>(channels::kPoseGraph, 0, [this](const pose_graph_t& msg) {
    if (const auto graph = graphs_.Add(msg)) collector_->Add(*graph);
  });
}

std::map<std::string, std::int64_t> CountersOf(MapperNode* mapper) {
  std::map<std::string, std::int64_t> counters;
  for (const counter_t& counter : mapper->health().Snapshot(0, 1.0).counters)
    if (counter.value != 0) counters[counter.name] = counter.value;
  return counters;
}

std::vector<std::string> ConditionsOf(MapperNode* mapper) {
  std::vector<std::string> sentences;
  for (const condition_t& condition : mapper->health().Snapshot(0, 1.0).conditions)
    if (condition.name != conditions::kNoOptimizer.name) sentences.push_back(condition.sentence);
  return sentences;
}

DiveReport ReportOf(MapperNode* mapper) {
  return {CountersOf(mapper),
          ConditionsOf(mapper),
          mapper->mapper().noise().timing,
          mapper->mapper().stamp_offsets(),
          std::nullopt};
}

Pipeline::Pipeline(const ReplayConfig& config,
                   const MapperConfig& mapper,
                   Bus* bus,
                   std::function<bool()> stopped,
                   MapRecorder* recorder)
    : bus_(bus),
      stopped_(std::move(stopped)),
      mapper_(mapper, bus, &worker_),
      optimizer_(LoadOptimizerConfig(config.optimizer.string()), bus, &worker_) {
  mapper_.Listen([recorder](const MapperEvent& event) { recorder->Add(event); });
  bus_->HandleAll();
}

void Pipeline::AddSubmap(Submap submap, Mapper::OfDive of_dive) {
  mapper_.AddSubmap(std::move(submap), std::move(of_dive));
  Settle();
}

void Pipeline::Settle() {
  bus_->HandleAll();
  while (!stopped_() && mapper_.LookAgain()) bus_->HandleAll();
}

void Pipeline::Finish() {
  mapper_.Finish();
  Settle();
}

std::string Pipeline::Statement() {
  std::string statement = mapper_.health().text();
  for (const auto& [name, value] : CountersOf(&mapper_))
    statement += ", " + name + " " + std::to_string(value);
  return statement;
}

}  // namespace seastitch
