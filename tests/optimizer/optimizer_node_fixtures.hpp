#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <fstream>
#include <limits>
#include <utility>

#include "common/runtime/config/config.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/optimizer_node.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "tests/optimizer/survey_graph.hpp"
#include "tests/support/paths.hpp"

// The mapper at the other end of the bus, for the tests of the optimizer's node.
namespace seastitch {

// The part of a mapper that the optimizer needs: keeps the graph, answers requests, collects
// solutions.
class MapperStub {
 public:
  MapperStub(const std::vector<GraphUpdate>& updates, Bus* bus) : updates_(updates), bus_(bus) {
    NameGraph(7);
    bus_->Subscribe<graph_request_t>("GRAPH_REQUEST", 16, [this](const graph_request_t& msg) {
      const bool is_of_another = msg.graph_id != 0 && msg.graph_id != graph_id;
      if (msg.sender != "optimizer" || is_of_another || silent) return;
      requests.push_back(msg.have_version);
      for (std::int64_t v = msg.have_version + 1; v <= published; ++v) Send(v);
    });
    bus_->Subscribe<pose_graph_t>("POSE_GRAPH", 0, [this](const pose_graph_t& msg) {
      utimes.push_back(msg.utime);
      if (auto solution = assembler_.Add(msg)) solutions.push_back(*solution);
    });
    bus_->Subscribe<covariances_t>(
        "COVARIANCES", 0, [this](const covariances_t& msg) { answers.push_back(*FromLcm(msg)); });
  }

  void Send(std::int64_t version) {
    const GraphUpdate& update = updates_[static_cast<std::size_t>(version - 1)];
    bus_->Publish("GRAPH_UPDATE", ToLcm(update, update.vertices[0].time, seq_++));
  }
  // Publishes the next update, or loses it.
  void PublishNext(bool lost = false) {
    ++published;
    if (!lost) Send(published);
    bus_->HandleAll();
  }
  void AskForCovariances(std::int64_t graph_version,
                         std::vector<std::pair<SubmapId, SubmapId>> pairs) {
    const CovarianceRequest request{"mapper", 4, graph_version, std::move(pairs), graph_id};
    bus_->Publish("COVARIANCE_REQUEST", ToLcm(request, FromUtime(0)));
    bus_->HandleAll();
  }
  void BeginAgain(const std::vector<GraphUpdate>& updates) {
    updates_ = updates;
    published = 0;
    NameGraph(graph_id + 1);
  }
  void AskForSolution(std::int64_t have_version) {
    graph_request_t msg{};
    msg.sender = "mapper";
    msg.graph_id = graph_id;
    msg.have_version = have_version;
    bus_->Publish("GRAPH_REQUEST", msg);
    bus_->HandleAll();
  }

  // The next update is the last one.
  void EndWithNext() { updates_[static_cast<std::size_t>(published)].final = true; }

  void NameGraph(std::int64_t id) {
    graph_id = id;
    for (GraphUpdate& update : updates_) update.graph_id = id;
  }

  std::int64_t graph_id = 0;
  bool silent = false;
  std::int64_t published = 0;
  std::vector<std::int64_t> requests;
  std::vector<std::int64_t> utimes;
  std::vector<PoseGraph> solutions;
  std::vector<PairCovariances> answers;

 private:
  std::vector<GraphUpdate> updates_;
  Bus* bus_;
  PoseGraphAssembler assembler_;
  std::int64_t seq_ = 0;
};

inline std::vector<GraphUpdate> SmallSurvey(unsigned seed = 3) {
  std::vector<GraphUpdate> updates =
      SimulateSurvey({.vertices = 12, .per_line = 4, .closures = 2, .seed = seed}).updates;
  for (GraphUpdate& update : updates) update.graph_id = 7;
  return updates;
}

}  // namespace seastitch
