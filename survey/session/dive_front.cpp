#include "survey/session/dive_front.hpp"

#include <Eigen/LU>
#include <memory>
#include <utility>
#include <variant>

namespace seastitch {
namespace {

MapperConfig WithoutRegistration(MapperConfig config) {
  config.loop_closer.overlap.max_pairs = 0;
  return config;
}

}  // namespace

std::optional<Eigen::Matrix3d> StartCovariance(const GraphEdge& start, double heading_sigma_rad) {
  const Eigen::Matrix2d covariance = start.information.topLeftCorner<2, 2>().inverse();
  if (!covariance.allFinite()) return std::nullopt;
  Eigen::Matrix3d of_start = Eigen::Matrix3d::Zero();
  of_start.topLeftCorner<2, 2>() = covariance;
  of_start(2, 2) = heading_sigma_rad * heading_sigma_rad;
  return of_start;
}

DiveFront::DiveFront(MapperConfig config,
                     std::int32_t chain,
                     std::int32_t first_id,
                     GiveSubmap give_submap,
                     GiveNav give_nav)
    : chain_{chain, std::nullopt, config.mounting},
      first_id_(first_id),
      next_id_(first_id),
      give_submap_(std::move(give_submap)),
      give_nav_(std::move(give_nav)),
      mapper_(WithoutRegistration(std::move(config)),
              [this](const MapperEvent& event) { On(event); }) {}

void DiveFront::On(const MapperEvent& event) {
  if (const auto* nav = std::get_if<NavState>(&event)) give_nav_(*nav);
  if (const auto* submap = std::get_if<std::shared_ptr<const Submap>>(&event)) {
    closed_.push_back({**submap, {chain_, {}}});
    closed_.back().submap.id.value += first_id_;
    next_id_ = closed_.back().submap.id.value + 1;
  }
  if (const auto* step = std::get_if<GraphStep>(&event)) Take(step->update);
}

// Gives the submaps before the one that joins the graph, and collects the edges that tie that one
// to the map. The other edges are computed again for all dives together.
void DiveFront::Take(const GraphUpdate& update) {
  for (const GraphVertex& vertex : update.vertices)
    while (!closed_.empty() && closed_.front().submap.id.value < vertex.id.value + first_id_)
      GiveFirst();
  if (closed_.empty()) return;
  Mapper::OfDive& dive = closed_.front().dive;
  for (GraphEdge edge : update.edges) {
    if (edge.from != edge.to) continue;
    edge.from.value += first_id_;
    edge.to = edge.from;
    if (edge.kind == EdgeKind::kDeadReckoning || !dive.chain.start_covariance)
      dive.chain.start_covariance =
          StartCovariance(edge, closed_.front().submap.heading_sigma_rad.value_or(kPi));
    dive.position_edges.push_back(edge);
  }
}

void DiveFront::GiveFirst() {
  Closed closed = std::move(closed_.front());
  closed_.pop_front();
  give_submap_(std::move(closed.submap), std::move(closed.dive));
}

void DiveFront::Finish() {
  mapper_.Finish();
  while (!closed_.empty()) GiveFirst();
}

}  // namespace seastitch
