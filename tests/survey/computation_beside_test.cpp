#include "survey/session/computation_beside.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace seastitch {
namespace {

Time At(double s) { return FromUtime(1'000'000'000 + static_cast<std::int64_t>(1e6 * s)); }

TEST(ComputationBeside, IsDueSomeSecondsOfTheDiveLater) {
  ComputationBeside<int> computation;
  EXPECT_FALSE(computation.IsRunning());
  computation.Start(At(10.0), [] { return 7; });
  EXPECT_TRUE(computation.IsRunning());
  EXPECT_FALSE(computation.IsDue(At(10.0)));
  EXPECT_FALSE(computation.IsDue(At(17.9)));
  EXPECT_TRUE(computation.IsDue(At(18.0)));
  EXPECT_TRUE(computation.IsDue(At(9.0))) << "a clock that stepped back";
  EXPECT_EQ(computation.Take(), 7);
  EXPECT_FALSE(computation.IsRunning());
}

TEST(ComputationBeside, IsDueAtOnceWithoutNavigation) {
  ComputationBeside<int> computation;
  computation.Start(std::nullopt, [] { return 7; });
  EXPECT_TRUE(computation.IsDue(std::nullopt));
  EXPECT_TRUE(computation.IsDue(At(10.0)));
  EXPECT_EQ(computation.Take(), 7);
}

TEST(ComputationBeside, GivesAnErrorToWhoeverTakesTheResult) {
  ComputationBeside<int> computation;
  computation.Start(At(0.0), []() -> int { throw std::runtime_error("no result"); });
  EXPECT_THROW(computation.Take(), std::runtime_error);
  EXPECT_FALSE(computation.IsRunning());
}

}  // namespace
}  // namespace seastitch
