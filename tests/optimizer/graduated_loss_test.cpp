#include "optimizer/solver/graduated_loss.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

constexpr double kMus[] = {1e-6, 1e-2, 0.5, GraduatedLoss::kFinalMu};

TEST(GraduatedLoss, WeightIsTheDerivativeOfTheValue) {
  const GraduatedLoss loss{16.27};
  for (const double mu : kMus)
    for (const double s : {1e-9, 0.1, 5.0, 12.0, 16.0, 20.0, 30.0, 1e4}) {
      const double step = 1e-6 * s;
      const double numeric = (loss.Value(s + step, mu) - loss.Value(s - step, mu)) / (2.0 * step);
      EXPECT_NEAR(loss.Weight(s, mu), numeric, 1e-4 * (1.0 + mu)) << "s " << s << " mu " << mu;
    }
}

TEST(GraduatedLoss, JumpsNowhere) {
  const GraduatedLoss loss{16.27};
  for (const double mu : kMus)
    for (const double s : {loss.FullUpTo(mu), loss.NothingFrom(mu)}) {
      EXPECT_NEAR(loss.Value(s * (1 - 1e-9), mu), loss.Value(s * (1 + 1e-9), mu), 1e-6 * s);
      EXPECT_NEAR(loss.Weight(s * (1 - 1e-9), mu), loss.Weight(s * (1 + 1e-9), mu), 1e-6);
    }
}

TEST(GraduatedLoss, KeepsHonestEdgesWholeAndDropsGrossOnes) {
  const GraduatedLoss loss{16.27};  // 99.9 % of chi-square, 3 degrees of freedom
  EXPECT_EQ(loss.Weight(7.8, GraduatedLoss::kFinalMu), 1.0);  // 95 %
  EXPECT_EQ(loss.Weight(25.0, GraduatedLoss::kFinalMu), 0.0);
}

}  // namespace
}  // namespace seastitch
