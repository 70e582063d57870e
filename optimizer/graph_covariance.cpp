#include "optimizer/graph_covariance.hpp"

#include <Eigen/OrderingMethods>
#include <algorithm>

namespace seastitch {
namespace {

// Two ends of a factor.
constexpr std::array<std::pair<std::size_t, std::size_t>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};

}  // namespace

std::optional<GraphCovariance> GraphCovariance::At(const FactorGraph& graph,
                                                   const std::vector<Pose2>& T_map_vertex,
                                                   const std::vector<double>& weights) {
  GraphCovariance covariance(graph);
  for (const Factor& factor : graph.factors)
    Residual(graph, factor, T_map_vertex, &covariance.jacobians_.emplace_back());
  covariance.Order();
  covariance.llt_ =
      std::make_unique<decltype(covariance.llt_)::element_type>(covariance.Information(weights));
  if (covariance.llt_->info() != Eigen::Success) return std::nullopt;
  return covariance;
}

// By minimum degree of the vertices: the three columns of one stay together.
void GraphCovariance::Order() {
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < graph_->num_vertices; ++v) entries.emplace_back(v, v, 1.0);
  for (const Factor& factor : graph_->factors) {
    const std::array<int, 3> ends = graph_->EndsOf(factor);
    for (const auto& [a, b] : kPairs)
      if (ends[a] != kMap && ends[b] != kMap) entries.emplace_back(ends[a], ends[b], 1.0);
  }
  Sparse pattern(graph_->num_vertices, graph_->num_vertices);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(pattern, order);
  column_.resize(static_cast<std::size_t>(graph_->num_vertices));
  for (int k = 0; k < graph_->num_vertices; ++k)
    column_[static_cast<std::size_t>(order.indices()(k))] = 3 * k;
}

// The lower triangle, zeros included where two vertices share a factor: L then has all entries that
// of_residual needs. The fixed vertex is an unknown that nothing moves.
GraphCovariance::Sparse GraphCovariance::Information(const std::vector<double>& weights) const {
  std::vector<Eigen::Matrix3d> diagonal(column_.size(), Eigen::Matrix3d::Zero());
  if (graph_->fixed_vertex >= 0)
    diagonal[static_cast<std::size_t>(graph_->fixed_vertex)].setIdentity();
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < graph_->factors.size(); ++k) {
    const std::array<int, 3> ends = graph_->EndsOf(graph_->factors[k]);
    const EndJacobians& J = jacobians_[k];
    for (std::size_t e = 0; e < ends.size(); ++e)
      if (ends[e] != kMap)
        diagonal[static_cast<std::size_t>(ends[e])] += weights[k] * J[e].transpose() * J[e];
    for (auto [a, b] : kPairs) {
      if (ends[a] == kMap || ends[b] == kMap) continue;
      if (Column(ends[a]) < Column(ends[b])) std::swap(a, b);
      const Eigen::Matrix3d block = weights[k] * J[a].transpose() * J[b];
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
          entries.emplace_back(Column(ends[a]) + r, Column(ends[b]) + c, block(r, c));
    }
  }
  for (std::size_t v = 0; v < diagonal.size(); ++v)
    for (int c = 0; c < 3; ++c)
      for (int r = c; r < 3; ++r)
        entries.emplace_back(column_[v] + r, column_[v] + c, diagonal[v](r, c));
  Sparse H(3 * graph_->num_vertices, 3 * graph_->num_vertices);
  H.setFromTriplets(entries.begin(), entries.end());
  return H;
}

// Of H, where L has entries, in their order (Takahashi's recursion). It goes by the structure of L
// and not by its values: a step at yaw 0 leaves zeros in L where its inverse has none.
std::vector<double> GraphCovariance::SelectedInverse() const {
  const int n = static_cast<int>(L().cols());
  const int* begin = L().outerIndexPtr();
  const int* row = L().innerIndexPtr();
  const double* l = L().valuePtr();
  const auto size = static_cast<std::size_t>(n);
  std::vector<double> Z(static_cast<std::size_t>(L().nonZeros()), 0.0), scaled(size, 0.0);
  std::vector<int> place(size, -1);  // of the entries of the column at work
  const auto at = [](auto& values, int k) -> auto& { return values[static_cast<std::size_t>(k)]; };
  for (int j = n - 1; j >= 0; --j) {
    const int first = begin[j] + 1, end = begin[j + 1];
    const double diagonal = l[begin[j]];
    for (int p = first; p < end; ++p) {
      at(scaled, row[p]) = l[p] / diagonal;
      at(place, row[p]) = p;
    }
    for (int p = first; p < end; ++p) {
      const int c = row[p];
      double sum = at(Z, begin[c]) * at(scaled, c);
      for (int q = begin[c] + 1; q < begin[c + 1]; ++q) {
        const int in_column = at(place, row[q]);
        if (in_column < 0) continue;
        sum += at(Z, q) * at(scaled, row[q]);
        at(Z, in_column) -= at(Z, q) * at(scaled, c);
      }
      at(Z, p) -= sum;
    }
    at(Z, begin[j]) = 1.0 / (diagonal * diagonal);
    for (int p = first; p < end; ++p) at(Z, begin[j]) -= at(Z, p) * at(scaled, row[p]);
    for (int p = first; p < end; ++p) at(place, row[p]) = -1;
  }
  return Z;
}

GraphCovariance::Selected GraphCovariance::MarginalsAndResiduals() const {
  const std::vector<double> Z = SelectedInverse();
  const int* row = L().innerIndexPtr();
  const int* begin = L().outerIndexPtr();
  const auto entry = [&](int r, int c) {
    if (r < c) std::swap(r, c);
    return Z[static_cast<std::size_t>(std::lower_bound(row + begin[c], row + begin[c + 1], r) -
                                      row)];
  };
  const auto block = [&](int u, int v) {
    Eigen::Matrix3d B;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) B(r, c) = entry(Column(u) + r, Column(v) + c);
    return B;
  };
  Selected out;
  for (int v = 0; v < graph_->num_vertices; ++v)
    out.marginal.push_back(IsFree(v) ? block(v, v) : Eigen::Matrix3d(Eigen::Matrix3d::Zero()));
  for (std::size_t k = 0; k < graph_->factors.size(); ++k)
    out.of_residual.push_back(OfResidual(k, block));
  return out;
}

std::vector<Eigen::Matrix3d> GraphCovariance::WithVertex(int vertex) const {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(L().cols(), 3);
  if (IsFree(vertex)) columns.middleRows<3>(Column(vertex)).setIdentity();
  columns = llt_->solve(columns).eval();
  std::vector<Eigen::Matrix3d> out;
  for (const int column : column_) out.emplace_back(columns.middleRows<3>(column));
  return out;
}

// Along the path from the vertex to the root of the elimination tree, beyond which L^-1 is zero.
const GraphCovariance::Pairs::InverseColumns& GraphCovariance::Pairs::ColumnsOf(int vertex) {
  const auto [it, is_new] = columns_.try_emplace(vertex);
  if (!is_new || !of_.IsFree(vertex)) return it->second;
  const int* begin = of_.L().outerIndexPtr();
  const int* row = of_.L().innerIndexPtr();
  const double* l = of_.L().valuePtr();
  const auto at = [this](int k) -> Eigen::Vector3d& { return work_[static_cast<std::size_t>(k)]; };
  const int first = of_.Column(vertex);
  for (int c = 0; c < 3; ++c) at(first + c)(c) = 1.0;
  for (int j = first; j >= 0; j = begin[j] + 1 < begin[j + 1] ? row[begin[j] + 1] : -1) {
    const Eigen::Vector3d value = at(j) / l[begin[j]];
    it->second.emplace_back(j, value);
    at(j).setZero();
    for (int p = begin[j] + 1; p < begin[j + 1]; ++p) at(row[p]) -= l[p] * value;
  }
  return it->second;
}

Eigen::Matrix3d GraphCovariance::Pairs::operator()(int a, int b) {
  const InverseColumns& of_a = ColumnsOf(a);
  const InverseColumns& of_b = ColumnsOf(b);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (auto i = of_a.begin(), j = of_b.begin(); i != of_a.end() && j != of_b.end();) {
    if (i->first == j->first)
      covariance += (i++)->second * (j++)->second.transpose();
    else
      ++(i->first < j->first ? i : j);
  }
  return covariance;
}

}  // namespace seastitch
