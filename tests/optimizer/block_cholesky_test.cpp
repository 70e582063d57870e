#include "optimizer/block_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace seastitch {
namespace {

struct System {
  BlockPattern pattern;
  BlockMatrix blocks;
  Eigen::MatrixXd dense;
};

// Sums of J^T J over random pairs of blocks and, far weaker, single blocks.
System RandomSystem(int num_blocks, int pairs, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto matrix = [&] {
    Eigen::Matrix3d m;
    for (double& value : m.reshaped()) value = normal(random);
    return m;
  };
  System s{{},
           {std::vector<Eigen::Matrix3d>(static_cast<std::size_t>(num_blocks),
                                         0.1 * Eigen::Matrix3d::Identity()),
            {}},
           0.1 * Eigen::MatrixXd::Identity(3 * num_blocks, 3 * num_blocks)};
  std::uniform_int_distribution<int> any(0, num_blocks - 1);
  for (int k = 0; k < pairs; ++k) {
    const int a = any(random), b = any(random);
    const Eigen::Matrix3d J_a = matrix(), J_b = a == b ? Eigen::Matrix3d::Zero() : matrix();
    s.pattern.emplace_back(a, b);
    s.blocks.diagonal[static_cast<std::size_t>(a)] += J_a.transpose() * J_a;
    s.blocks.diagonal[static_cast<std::size_t>(b)] += J_b.transpose() * J_b;
    s.blocks.off_diagonal.emplace_back(J_a.transpose() * J_b);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 3 * num_blocks);
    J.middleCols<3>(3 * a) += J_a;
    J.middleCols<3>(3 * b) += J_b;
    s.dense += J.transpose() * J;
  }
  return s;
}

class RandomGraphs : public ::testing::TestWithParam<std::pair<int, int>> {};

TEST_P(RandomGraphs, SolveAndInverseEqualTheDenseOnes) {
  const auto& [num_blocks, pairs] = GetParam();
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const System s = RandomSystem(num_blocks, pairs, seed);
    BlockCholesky cholesky(num_blocks, s.pattern);
    ASSERT_TRUE(cholesky.Factorize(s.blocks));
    const Eigen::MatrixXd B = Eigen::MatrixXd::Random(3 * num_blocks, 2);
    EXPECT_LT((s.dense * cholesky.Solve(B) - B).norm(), 1e-10 * B.norm());
    const Eigen::MatrixXd dense = s.dense.inverse();
    const BlockMatrix inverse = cholesky.InverseInPattern();
    for (int v = 0; v < num_blocks; ++v)
      EXPECT_LT(
          (inverse.diagonal[static_cast<std::size_t>(v)] - dense.block<3, 3>(3 * v, 3 * v)).norm(),
          1e-10 * dense.norm());
    for (std::size_t k = 0; k < s.pattern.size(); ++k) {
      const auto& [a, b] = s.pattern[k];
      if (a == b) continue;
      EXPECT_LT((inverse.off_diagonal[k] - dense.block<3, 3>(3 * a, 3 * b)).norm(),
                1e-10 * dense.norm());
    }
  }
}

// One block, no pair, a forest, sparse to full.
INSTANTIATE_TEST_SUITE_P(Sizes,
                         RandomGraphs,
                         ::testing::Values(std::pair{1, 0},
                                           std::pair{5, 0},
                                           std::pair{40, 15},
                                           std::pair{60, 90},
                                           std::pair{50, 600}));

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefinite) {
  System s = RandomSystem(20, 40, 1);
  BlockCholesky cholesky(20, s.pattern);
  EXPECT_TRUE(cholesky.Factorize(s.blocks));
  s.blocks.diagonal[7](1, 1) = -1.0;
  EXPECT_FALSE(cholesky.Factorize(s.blocks));
  s.blocks.diagonal[7](1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cholesky.Factorize(s.blocks));
}

}  // namespace
}  // namespace seastitch
