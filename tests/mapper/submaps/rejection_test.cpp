#include "mapper/submaps/losses.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

TEST(Rejection, NamesTheReasonOnlyWhereItIsUnusual) {
  EXPECT_EQ(RejectionOf(1000, {{"soundings_outliers", 12}}).Text(), "1.2 % of soundings rejected");
  EXPECT_EQ(RejectionOf(1000, {{"beams_refused", 20}, {"soundings_too_far", 60}}).Text(),
            "8.0 % of soundings rejected, most of them soundings_too_far");
  EXPECT_EQ(RejectionOf(0, {}).Text(), "0.0 % of soundings rejected");
}

}  // namespace
}  // namespace seastitch
