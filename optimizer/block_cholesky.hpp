#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace seastitch {

// Which blocks of a symmetric matrix of 3 x 3 blocks may be other than zero, beside its diagonal:
// (row, column) of one of each two mirrored ones. A pair may come more than once; (a, a) is
// nothing.
using BlockPattern = std::vector<std::pair<int, int>>;

// Those blocks: diagonal[v] at (v, v), off_diagonal[k] at pattern[k]; blocks of a pair that comes
// more than once add up.
struct BlockMatrix {
  std::vector<Eigen::Matrix3d> diagonal;
  std::vector<Eigen::Matrix3d> off_diagonal;
};

// L L^T of a sparse, symmetric, positive definite matrix of 3 x 3 blocks by the multifrontal method
// (Duff and Reid, "The multifrontal solution of indefinite sparse symmetric linear equations", TOMS
// 1983) in approximate minimum degree order: all work is done in dense matrices, one a supernode.
// Order and structure are found once. One thread and no BLAS: the same bytes on any core count and
// whatever BLAS is installed.
class BlockCholesky {
 public:
  BlockCholesky(int num_blocks, BlockPattern pattern);

  std::size_t num_off_diagonal() const { return pattern_.size(); }

  // False where the matrix is not positive definite: there is then no factor to use.
  bool Factorize(const BlockMatrix& matrix);

  // The inverse times B, rows in the order of the blocks.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const;

  // The blocks of the inverse on the diagonal and in the pattern, by Takahashi's recursion from the
  // last column to the first (Erisman and Tinney, "On computing certain elements of the inverse of
  // a sparse matrix", CACM 1975): exact, at about twice the cost of the factor.
  BlockMatrix InverseInPattern() const;

 private:
  // Neighbouring columns of the factor that have their rows in common. All numbers are places in
  // the order of elimination.
  struct Supernode {
    int first = 0;
    int columns = 0;
    std::vector<int> rows;      // below the columns, rising
    std::int64_t zeros = 0;     // blocks stored that are known to be zero
    int parent = -1;            // the supernode that eliminates the first row; -1: a root
    std::vector<int> children;  // rising
    std::vector<int> entries;   // of the pattern, in these columns

    int size() const { return columns + static_cast<int>(rows.size()); }
    int PlaceOf(int number) const;  // in columns and rows, counted together
  };
  struct Front;

  void FindSupernodes(std::vector<std::vector<int>> rows);
  void LinkSupernodes();
  void Assemble(const BlockMatrix& matrix, const Supernode& node, Front* front) const;
  void ExtendAdd(const Supernode& child, const Eigen::MatrixXd& update, Front* front) const;
  Eigen::MatrixXd InverseOfFront(int s, const Eigen::MatrixXd& inverse_of_parent) const;

  const int num_blocks_;
  const BlockPattern pattern_;
  std::vector<int> block_;             // by place in the order of elimination
  std::vector<int> number_;            // the place of each block
  std::vector<Supernode> supernodes_;  // children before parents
  std::vector<Eigen::MatrixXd> L_;     // of each supernode: columns and rows by columns
};

}  // namespace seastitch
