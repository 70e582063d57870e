#include "optimizer/solver/graph_builder.hpp"

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>

#include "optimizer/solver/heading_chain.hpp"

namespace seastitch {
namespace {

// Sigmas of the first submap where it defines the map's position and heading.
constexpr double kHeld_m = 1e-3;
// Sigma of the position of a chain's first submap that is not known. Large enough that every fix
// agrees with it, and finite, so that the graph is well conditioned where all fixes are outliers.
constexpr double kUnknownPlace_m = 1e4;
constexpr double kHeld_rad = 1e-5;

Eigen::Matrix3d InverseSigmas(double sigma_m, double sigma_yaw_rad) {
  return Eigen::Vector3d(1.0 / sigma_m, 1.0 / sigma_m, 1.0 / sigma_yaw_rad).asDiagonal();
}

// Factor::group_size of each loop closure: how many closures, itself included, have both submaps at
// most one submap away from its own. They are computed from the same seabed, and their errors are
// correlated. Neighbours of neighbours do not count. closures: pairs of vertex numbers, smaller
// first, sorted.
std::vector<int> GroupSizes(const std::vector<std::pair<int, int>>& closures) {
  std::vector<int> sizes(closures.size(), 0);
  for (const int step : {-1, 0, 1}) {
    auto begin = closures.begin();
    auto end = closures.begin();
    for (std::size_t k = 0; k < closures.size(); ++k) {
      const auto& [a, b] = closures[k];
      while (begin != closures.end() && *begin < std::pair{a + step, b - 1}) ++begin;
      while (end != closures.end() && *end <= std::pair{a + step, b + 1}) ++end;
      sizes[k] += static_cast<int>(end - begin);
    }
  }
  return sizes;
}

class GraphBuilder {
 public:
  GraphBuilder(const GraphStore& store, const OptimizerParams& params)
      : store_(store), params_(params), number_(VertexNumbers(store)) {}

  FactorGraph Build() {
    graph_.num_vertices = static_cast<int>(number_.size());
    AddMounting();
    const std::vector<Vertex> chains = BeginningsOfChains();
    std::vector<HeadingInformation> headings;
    for (const Vertex begin : chains) headings.push_back(Headings(begin));
    for (std::size_t c = 0; c < chains.size(); ++c) AddAnchor(chains[c], headings[c]);
    AddSteps();
    for (std::size_t c = 0; c < chains.size(); ++c) AddHeadings(chains[c], headings[c]);
    AddRobustEdges();
    return std::move(graph_);
  }

 private:
  using Vertex = std::map<SubmapId, StoredVertex>::const_iterator;

  std::vector<Vertex> BeginningsOfChains() const {
    std::vector<Vertex> begins;
    for (Vertex v = store_.vertices().begin(); v != store_.vertices().end(); ++v)
      if (begins.empty() || v->second.chain != begins.back()->second.chain) begins.push_back(v);
    return begins;
  }

  // How a measurement depends on the mounting errors of one dive, of those that are estimated.
  MountingTerm TermOf(std::int32_t chain, const Eigen::Matrix3d& by_mounting) const {
    const auto vertex = mounting_vertex_.find(chain);
    if (vertex == mounting_vertex_.end()) return {};
    return {vertex->second, EstimatedColumns(by_mounting, store_.mounting().at(chain))};
  }

  std::array<MountingTerm, 2> TermsOf(const GraphEdge& edge) const {
    const std::int32_t from = store_.vertices().at(edge.from).chain;
    const std::int32_t to = store_.vertices().at(edge.to).chain;
    const EdgeByMounting by = ByMounting(edge, from == to);
    if (from == to) return {TermOf(to, by.of_to)};
    return {TermOf(to, by.of_to), TermOf(from, by.of_from)};
  }

  Pose2 MeasurementOf(const GraphEdge& edge) const {
    const std::int32_t to = store_.vertices().at(edge.to).chain;
    const std::optional<double> newest_rad = store_.newest_dvl_yaw_rad(to);
    const bool one_dive = store_.vertices().at(edge.from).chain == to;
    return MeasuredBy(newest_rad.value_or(edge.dvl_yaw_rad), edge, ByMounting(edge, one_dive));
  }

  void AddMounting() {
    for (const auto& [chain, sigmas] : store_.mounting()) {
      mounting_vertex_[chain] = graph_.num_vertices++;
      ++graph_.num_mountings;
      // An error that is not estimated stays zero with any weight.
      Eigen::Matrix3d W = Eigen::Matrix3d::Identity();
      for (int k = 0; k < 3; ++k)
        if (const double sigma = sigmas.Vector()(k); sigma > 0.0) W(k, k) = 1.0 / sigma;
      graph_.factors.push_back({.j = mounting_vertex_[chain], .W = W});
    }
  }

  // Prior of position and heading of a chain's first submap. A first chain without either defines
  // the map frame; a later one is then placed by loop closures alone.
  void AddAnchor(Vertex begin, const HeadingInformation& headings) {
    const StoredVertex& first = begin->second;
    const bool is_first_chain = begin == store_.vertices().begin();
    const int j = number_.at(begin->first);
    const MountingTerm mounting = TermOf(first.chain, PositionByMounting(first.dead_reckoned.yaw));
    const bool has_fixes = !store_.fixes().empty();
    if (is_first_chain && !has_fixes && !first.heading_sigma_rad && mounting.vertex == kMap) {
      graph_.fixed_vertex = 0;
      return;
    }
    const bool held = is_first_chain && !has_fixes;
    double sigma_m = held ? kHeld_m : kUnknownPlace_m;
    const auto start = store_.starts().find(begin->first);
    if (start != store_.starts().end() && start->second.root.rank >= 2) {
      graph_.factors.push_back({.j = j,
                                .T_i_j = start->second.edge.T_from_to,
                                .W = start->second.root.W,
                                .is_dead_reckoning = true,
                                .mounting = {mounting}});
      sigma_m = std::numeric_limits<double>::infinity();
    }
    double sigma_yaw_rad = held ? kHeld_rad : params_.unlinked_sigma_yaw_rad;
    if (first.heading_sigma_rad) sigma_yaw_rad = 1.0 / std::sqrt(headings.first + headings.each);
    graph_.factors.push_back({.j = j,
                              .T_i_j = first.dead_reckoned,
                              .W = InverseSigmas(sigma_m, sigma_yaw_rad),
                              .mounting = {mounting}});
  }

  void AddSteps() {
    std::vector<bool> linked(number_.size(), false);
    for (const auto& [pair, edge] : store_.dead_reckoning()) {
      const GraphEdge& e = edge.edge;
      if (!edge.Pulls()) continue;
      const bool is_step = edge.root.rank == 3;
      graph_.factors.push_back({.i = number_.at(e.from),
                                .j = number_.at(e.to),
                                .T_i_j = MeasurementOf(e),
                                .W = edge.root.W,
                                .is_dead_reckoning = true,
                                .is_step = is_step,
                                .mounting = TermsOf(e)});
      if (is_step) linked[static_cast<std::size_t>(number_.at(pair.second))] = true;
    }
    int k = 1;
    for (auto before = store_.vertices().begin(), it = std::next(before);
         it != store_.vertices().end();
         before = it++, ++k) {
      if (linked[static_cast<std::size_t>(k)]) continue;
      const Pose2 T_before_it = Inverse(before->second.dead_reckoned) * it->second.dead_reckoned;
      const bool same_chain = before->second.chain == it->second.chain;
      graph_.factors.push_back(
          {.i = k - 1,
           .j = k,
           .T_i_j = T_before_it,
           .W = InverseSigmas(same_chain ? params_.unlinked_sigma_m : kUnknownPlace_m,
                              params_.unlinked_sigma_yaw_rad),
           .is_dead_reckoning = true,
           .mounting = {same_chain ? TermOf(it->second.chain, DeadReckoningByMounting(T_before_it))
                                   : MountingTerm{}}});
    }
  }

  HeadingInformation Headings(Vertex begin) const {
    const std::optional<double> sigma_first_rad = begin->second.heading_sigma_rad;
    if (!sigma_first_rad) return {};
    std::vector<HeadingStep> steps;
    for (const auto& [pair, edge] : store_.dead_reckoning()) {
      const StoredVertex& from = store_.vertices().at(edge.edge.from);
      if (from.chain != begin->second.chain) continue;
      const auto sigma_from_rad = from.heading_sigma_rad;
      const auto sigma_to_rad = store_.vertices().at(edge.edge.to).heading_sigma_rad;
      if (!edge.Pulls() || edge.root.rank < 3 || !sigma_from_rad || !sigma_to_rad) continue;
      // Bounds the variance of the difference: the inverse of a nearly singular information may
      // exceed it.
      const double most = std::pow(*sigma_from_rad + *sigma_to_rad, 2);
      steps.push_back({*sigma_from_rad * *sigma_from_rad,
                       *sigma_to_rad * *sigma_to_rad,
                       std::min(most, edge.edge.information.inverse()(2, 2))});
    }
    return InformationOfHeadings(*sigma_first_rad * *sigma_first_rad, steps);
  }

  // Heading factors of all submaps of a chain but the first, whose heading is in the anchor.
  void AddHeadings(Vertex begin, const HeadingInformation& headings) {
    if (headings.each == 0.0) return;
    Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
    W(2, 2) = std::sqrt(headings.each);
    int k = number_.at(begin->first) + 1;
    for (auto it = std::next(begin);
         it != store_.vertices().end() && it->second.chain == begin->second.chain;
         ++it, ++k)
      if (it->second.heading_sigma_rad)
        graph_.factors.push_back({.j = k, .T_i_j = it->second.dead_reckoned, .W = W});
  }

  void AddRobustEdges() {
    std::array<double, 4> threshold;  // by degrees of freedom
    for (int dof = 1; dof <= 3; ++dof)
      threshold[static_cast<std::size_t>(dof)] =
          boost::math::quantile(boost::math::chi_squared(dof), params_.inlier_probability);
    const std::vector<const StoredEdge*> edges = store_.RobustEdges();
    std::vector<std::pair<int, int>> closures;
    for (const StoredEdge* edge : edges)
      if (edge->edge.kind == EdgeKind::kLoopClosure)
        closures.push_back(std::minmax({number_.at(edge->edge.from), number_.at(edge->edge.to)}));
    const std::vector<int> group_sizes = GroupSizes(closures);
    auto group_size = group_sizes.begin();
    for (const StoredEdge* edge : edges) {
      const GraphEdge& e = edge->edge;
      const bool is_fix = e.kind == EdgeKind::kPositionFix;
      graph_.factors.push_back({.i = is_fix ? kMap : number_.at(e.from),
                                .j = number_.at(e.to),
                                .T_i_j = MeasurementOf(e),
                                .W = edge->root.W,
                                .loss = {threshold[static_cast<std::size_t>(edge->root.rank)]},
                                .group_size = is_fix ? 1 : *group_size++,
                                .mounting = TermsOf(e)});
    }
  }

  const GraphStore& store_;
  const OptimizerParams& params_;
  const std::map<SubmapId, int> number_;
  std::map<std::int32_t, int> mounting_vertex_;  // by chain
  FactorGraph graph_;
};

}  // namespace

FactorGraph BuildFactorGraph(const GraphStore& store, const OptimizerParams& params) {
  return GraphBuilder(store, params).Build();
}

std::map<SubmapId, int> VertexNumbers(const GraphStore& store) {
  std::map<SubmapId, int> number;
  for (const auto& [id, vertex] : store.vertices())
    number.emplace_hint(number.end(), id, static_cast<int>(number.size()));
  return number;
}

Eigen::Matrix3d EstimatedColumns(const Eigen::Matrix3d& by_mounting, const MountingSigmas& sigmas) {
  return by_mounting * (sigmas.Vector().array() > 0.0).cast<double>().matrix().asDiagonal();
}

}  // namespace seastitch
