#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

// A mapper that is embedded without a node, and a dive for it.
namespace seastitch {

inline constexpr double kSpeedMps = 1.5;

// A program that embeds a Mapper.
struct Embedding {
  explicit Embedding(const MapperParams& params = {}, std::size_t prepared_bytes = 32'000'000)
      : registration(params.loop_closer),
        mapper(params),
        prepared(registration.registration, prepared_bytes) {}

  void Drive(double duration_s, double speed_mps = kSpeedMps) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle.Step(speed_mps, 0.0))
        std::visit([this](const auto& s) { mapper.Add(s); }, sample);
      Pump();
    }
  }
  void AddSubmap(Submap submap) {
    mapper.AddSubmap(std::move(submap));
    Pump();
  }
  void Finish() {
    mapper.Finish();
    Pump();
  }
  void Pump() {
    TakeEvents();
    while (auto job = mapper.NextJob()) {
      mapper.Take(Run(*job, registration, load, &prepared));
      TakeEvents();
    }
  }
  void TakeEvents() {
    for (const MapperEvent& event : mapper.TakeEvents()) {
      if (const auto* nav = std::get_if<NavState>(&event)) navs.push_back(*nav);
      if (const auto* corrected = std::get_if<CorrectedNavState>(&event)) said = *corrected;
      if (const auto* submap = std::get_if<std::shared_ptr<const Submap>>(&event))
        submaps[(*submap)->id] = *submap;
      if (const auto* step = std::get_if<GraphStep>(&event)) steps.push_back(*step);
    }
  }
  std::vector<GraphEdge> Edges(EdgeKind kind) const {
    std::vector<GraphEdge> edges;
    for (const GraphStep& step : steps)
      for (const GraphEdge& edge : step.update.edges)
        if (edge.kind == kind) edges.push_back(edge);
    return edges;
  }

  const LoopCloserParams registration;
  PerfectVehicle vehicle;
  Mapper mapper;
  PreparedSubmaps prepared;
  std::vector<NavState> navs;
  std::optional<CorrectedNavState> said;
  std::map<SubmapId, std::shared_ptr<const Submap>> submaps;
  std::vector<GraphStep> steps;
  LoadSubmap load = [this](SubmapId id) { return submaps.at(id); };
};

}  // namespace seastitch
