#include "optimizer/block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <numeric>

namespace seastitch {
namespace {

template <class T>
T& At(std::vector<T>& v, int i) {
  return v[static_cast<std::size_t>(i)];
}
template <class T>
const T& At(const std::vector<T>& v, int i) {
  return v[static_cast<std::size_t>(i)];
}

auto Block(Eigen::MatrixXd& m, int row, int column) { return m.block<3, 3>(3 * row, 3 * column); }
auto Block(const Eigen::MatrixXd& m, int row, int column) {
  return m.block<3, 3>(3 * row, 3 * column);
}

// By place in the order, the block that stands there.
std::vector<int> MinimumDegreeOrder(int num_blocks, const BlockPattern& pattern) {
  std::vector<Eigen::Triplet<int>> entries;
  for (int v = 0; v < num_blocks; ++v) entries.emplace_back(v, v, 1);
  for (const auto& [a, b] : pattern) {
    entries.emplace_back(a, b, 1);
    entries.emplace_back(b, a, 1);
  }
  Eigen::SparseMatrix<int> graph(num_blocks, num_blocks);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph, order);
  return {order.indices().data(), order.indices().data() + num_blocks};
}

std::vector<int> InverseOf(const std::vector<int>& permutation) {
  std::vector<int> inverse(permutation.size());
  for (std::size_t k = 0; k < permutation.size(); ++k)
    At(inverse, permutation[k]) = static_cast<int>(k);
  return inverse;
}

void SortUnique(std::vector<int>* v) {
  std::sort(v->begin(), v->end());
  v->erase(std::unique(v->begin(), v->end()), v->end());
}

// The rows of the factor below the diagonal of each column: those of the matrix and, without
// itself, those of its children in the elimination tree. The parent of a column is its first row.
std::vector<std::vector<int>> RowsOfFactor(const std::vector<int>& number,
                                           const BlockPattern& pattern) {
  std::vector<std::vector<int>> rows(number.size());
  for (const auto& [a, b] : pattern)
    if (a != b)
      At(rows, std::min(At(number, a), At(number, b)))
          .push_back(std::max(At(number, a), At(number, b)));
  for (std::vector<int>& column : rows) {
    SortUnique(&column);
    if (column.empty()) continue;
    // All that comes from children is there: they were before.
    std::vector<int>& parent = At(rows, column.front());
    parent.insert(parent.end(), std::next(column.begin()), column.end());
  }
  return rows;
}

// By new place, the old one: every column directly after its descendants.
std::vector<int> PostOrder(const std::vector<std::vector<int>>& rows) {
  const int n = static_cast<int>(rows.size());
  std::vector<std::vector<int>> children(rows.size());
  std::vector<int> stack;
  for (int j = n - 1; j >= 0; --j)
    if (At(rows, j).empty())
      stack.push_back(j);
    else
      At(children, At(rows, j).front()).push_back(j);
  // Parents first, from behind.
  std::vector<int> order;
  while (!stack.empty()) {
    order.push_back(stack.back());
    stack.pop_back();
    const std::vector<int>& below = At(children, order.back());
    stack.insert(stack.end(), below.begin(), below.end());
  }
  std::reverse(order.begin(), order.end());
  return order;
}

// Whether so many zeros are worth the larger dense matrices.
bool MayHold(std::int64_t zeros, int columns, int rows) {
  const std::int64_t blocks =
      std::int64_t{columns} * (columns + 1) / 2 + std::int64_t{columns} * rows;
  const double share = columns <= 4 ? 0.5 : columns <= 16 ? 0.2 : 0.05;
  return static_cast<double>(zeros) <= share * static_cast<double>(blocks);
}

}  // namespace

// What a supernode is factorised in: its columns and rows by its columns, and what it leaves for
// its rows by its rows (lower triangles).
struct BlockCholesky::Front {
  int columns;
  Eigen::MatrixXd L;
  Eigen::MatrixXd update;

  explicit Front(const Supernode& node)
      : columns(node.columns),
        L(Eigen::MatrixXd::Zero(3 * node.size(), 3 * node.columns)),
        update(Eigen::MatrixXd::Zero(3 * (node.size() - node.columns),
                                     3 * (node.size() - node.columns))) {}

  // row >= column, places in the supernode.
  template <class Derived>
  void Add(int row, int column, const Eigen::MatrixBase<Derived>& block) {
    if (column < columns)
      Block(L, row, column) += block;
    else
      Block(update, row - columns, column - columns) += block;
  }

  bool Factorize() {
    auto diagonal = L.topRows(3 * columns);
    if (!diagonal.allFinite()) return false;
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(diagonal);
    if (cholesky.info() != Eigen::Success) return false;
    auto below = L.bottomRows(update.rows());
    diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
    update.selfadjointView<Eigen::Lower>().rankUpdate(below, -1.0);
    return true;
  }
};

int BlockCholesky::Supernode::PlaceOf(int number) const {
  if (number < first + columns) return number - first;
  return columns +
         static_cast<int>(std::lower_bound(rows.begin(), rows.end(), number) - rows.begin());
}

BlockCholesky::BlockCholesky(int num_blocks, BlockPattern pattern)
    : num_blocks_(num_blocks), pattern_(std::move(pattern)) {
  const std::vector<int> order = MinimumDegreeOrder(num_blocks_, pattern_);
  for (const int k : PostOrder(RowsOfFactor(InverseOf(order), pattern_)))
    block_.push_back(At(order, k));
  number_ = InverseOf(block_);
  FindSupernodes(RowsOfFactor(number_, pattern_));
  LinkSupernodes();
}

// Every column begins as one of its own and takes in the one before it where that is its child and
// few zeros come of it.
void BlockCholesky::FindSupernodes(std::vector<std::vector<int>> rows) {
  for (int j = 0; j < num_blocks_; ++j) {
    Supernode node;
    node.first = j;
    node.columns = 1;
    node.rows = std::move(At(rows, j));
    while (!supernodes_.empty()) {
      const Supernode& child = supernodes_.back();
      if (child.rows.empty() || child.rows.front() > j) break;
      const std::int64_t zeros =
          node.zeros + child.zeros +
          std::int64_t{child.columns} * (node.size() - static_cast<int>(child.rows.size()));
      if (!MayHold(zeros, node.columns + child.columns, static_cast<int>(node.rows.size()))) break;
      node.zeros = zeros;
      node.first = child.first;
      node.columns += child.columns;
      supernodes_.pop_back();
    }
    supernodes_.push_back(std::move(node));
  }
}

void BlockCholesky::LinkSupernodes() {
  std::vector<int> of_column;
  for (int s = 0; s < static_cast<int>(supernodes_.size()); ++s)
    of_column.insert(of_column.end(), static_cast<std::size_t>(At(supernodes_, s).columns), s);
  for (int s = 0; s < static_cast<int>(supernodes_.size()); ++s) {
    Supernode& node = At(supernodes_, s);
    if (node.rows.empty()) continue;
    node.parent = At(of_column, node.rows.front());
    At(supernodes_, node.parent).children.push_back(s);
  }
  for (int k = 0; k < static_cast<int>(pattern_.size()); ++k) {
    const auto& [a, b] = At(pattern_, k);
    if (a != b)
      At(supernodes_, At(of_column, std::min(At(number_, a), At(number_, b)))).entries.push_back(k);
  }
  L_.resize(supernodes_.size());
}

void BlockCholesky::Assemble(const BlockMatrix& matrix, const Supernode& node, Front* front) const {
  for (int c = 0; c < node.columns; ++c)
    front->Add(c, c, At(matrix.diagonal, At(block_, node.first + c)));
  for (const int k : node.entries) {
    const auto& [a, b] = At(pattern_, k);
    const int row = node.PlaceOf(At(number_, a));
    const int column = node.PlaceOf(At(number_, b));
    if (row > column)
      front->Add(row, column, At(matrix.off_diagonal, k));
    else
      front->Add(column, row, At(matrix.off_diagonal, k).transpose());
  }
}

void BlockCholesky::ExtendAdd(const Supernode& child,
                              const Eigen::MatrixXd& update,
                              Front* front) const {
  const Supernode& node = At(supernodes_, child.parent);
  std::vector<int> place;
  for (const int row : child.rows) place.push_back(node.PlaceOf(row));
  const int n = static_cast<int>(place.size());
  for (int c = 0; c < n; ++c)
    for (int r = c; r < n; ++r) front->Add(At(place, r), At(place, c), Block(update, r, c));
}

bool BlockCholesky::Factorize(const BlockMatrix& matrix) {
  std::vector<Eigen::MatrixXd> updates(supernodes_.size());
  for (int s = 0; s < static_cast<int>(supernodes_.size()); ++s) {
    const Supernode& node = At(supernodes_, s);
    Front front(node);
    Assemble(matrix, node, &front);
    for (const int child : node.children) {
      ExtendAdd(At(supernodes_, child), At(updates, child), &front);
      At(updates, child).resize(0, 0);
    }
    if (!front.Factorize()) return false;
    At(L_, s) = std::move(front.L);
    At(updates, s) = std::move(front.update);
  }
  return true;
}

Eigen::MatrixXd BlockCholesky::Solve(const Eigen::MatrixXd& B) const {
  Eigen::MatrixXd X(B.rows(), B.cols());
  for (int k = 0; k < num_blocks_; ++k) X.middleRows<3>(3 * k) = B.middleRows<3>(3 * At(block_, k));
  Eigen::MatrixXd below;
  const auto gather = [&](const Supernode& node) {
    below.resize(3 * static_cast<Eigen::Index>(node.rows.size()), X.cols());
    for (std::size_t r = 0; r < node.rows.size(); ++r)
      below.middleRows<3>(3 * static_cast<Eigen::Index>(r)) = X.middleRows<3>(3 * node.rows[r]);
  };
  for (std::size_t s = 0; s < supernodes_.size(); ++s) {
    const Supernode& node = supernodes_[s];
    auto own = X.middleRows(3 * node.first, 3 * node.columns);
    L_[s].topRows(3 * node.columns).triangularView<Eigen::Lower>().solveInPlace(own);
    below.noalias() = L_[s].bottomRows(3 * static_cast<Eigen::Index>(node.rows.size())) * own;
    for (std::size_t r = 0; r < node.rows.size(); ++r)
      X.middleRows<3>(3 * node.rows[r]) -= below.middleRows<3>(3 * static_cast<Eigen::Index>(r));
  }
  for (std::size_t s = supernodes_.size(); s-- > 0;) {
    const Supernode& node = supernodes_[s];
    auto own = X.middleRows(3 * node.first, 3 * node.columns);
    gather(node);
    own.noalias() -= L_[s].bottomRows(below.rows()).transpose() * below;
    L_[s].topRows(3 * node.columns).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  Eigen::MatrixXd out(B.rows(), B.cols());
  for (int k = 0; k < num_blocks_; ++k)
    out.middleRows<3>(3 * At(block_, k)) = X.middleRows<3>(3 * k);
  return out;
}

// The inverse over columns and rows of a supernode, from that of its parent, which has the rows.
Eigen::MatrixXd BlockCholesky::InverseOfFront(int s,
                                              const Eigen::MatrixXd& inverse_of_parent) const {
  const Supernode& node = At(supernodes_, s);
  const int columns = 3 * node.columns;
  const int rows = 3 * static_cast<int>(node.rows.size());
  Eigen::MatrixXd Z(columns + rows, columns + rows);
  std::vector<int> place;
  for (const int row : node.rows) place.push_back(At(supernodes_, node.parent).PlaceOf(row));
  for (int c = 0; c < static_cast<int>(place.size()); ++c)
    for (int r = 0; r < static_cast<int>(place.size()); ++r)
      Block(Z, node.columns + r, node.columns + c) =
          Block(inverse_of_parent, At(place, r), At(place, c));

  const auto L_columns = At(L_, s).topRows(columns).triangularView<Eigen::Lower>();
  Eigen::MatrixXd Y = At(L_, s).bottomRows(rows);
  if (rows > 0) L_columns.solveInPlace<Eigen::OnTheRight>(Y);
  Eigen::MatrixXd inverse_L = Eigen::MatrixXd::Identity(columns, columns);
  L_columns.solveInPlace(inverse_L);
  Z.bottomLeftCorner(rows, columns).noalias() = -(Z.bottomRightCorner(rows, rows) * Y);
  Z.topRightCorner(columns, rows) = Z.bottomLeftCorner(rows, columns).transpose();
  Z.topLeftCorner(columns, columns).noalias() = inverse_L.transpose() * inverse_L;
  Z.topLeftCorner(columns, columns).noalias() -= Y.transpose() * Z.bottomLeftCorner(rows, columns);
  return Z;
}

BlockMatrix BlockCholesky::InverseInPattern() const {
  BlockMatrix out{std::vector<Eigen::Matrix3d>(static_cast<std::size_t>(num_blocks_)),
                  std::vector<Eigen::Matrix3d>(pattern_.size(), Eigen::Matrix3d::Zero())};
  std::vector<Eigen::MatrixXd> fronts(supernodes_.size());
  for (int s = static_cast<int>(supernodes_.size()) - 1; s >= 0; --s) {
    const Supernode& node = At(supernodes_, s);
    if (node.parent < 0) {
      At(fronts, s) = InverseOfFront(s, {});
    } else {
      At(fronts, s) = InverseOfFront(s, At(fronts, node.parent));
      if (At(supernodes_, node.parent).children.front() == s)  // the last that needs it
        At(fronts, node.parent).resize(0, 0);
    }
    const Eigen::MatrixXd& Z = At(fronts, s);
    for (int c = 0; c < node.columns; ++c)
      At(out.diagonal, At(block_, node.first + c)) = Block(Z, c, c);
    for (const int k : node.entries) {
      const auto& [a, b] = At(pattern_, k);
      At(out.off_diagonal, k) =
          Block(Z, node.PlaceOf(At(number_, a)), node.PlaceOf(At(number_, b)));
    }
    if (node.children.empty()) At(fronts, s).resize(0, 0);
  }
  return out;
}

}  // namespace seastitch
