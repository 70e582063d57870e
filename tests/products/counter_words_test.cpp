#include "products/report/counter_words.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace seastitch {
namespace {

TEST(CounterInWords, HasNoUnderscoreAndNoPrefixOfThePartThatCounts) {
  for (const auto& [name, words] :
       {std::pair("damaged_bytes", "damaged bytes"),
        std::pair("survey_pings_without_position", "pings without position"),
        std::pair("nav_dvl_refused", "DVL refused"),
        std::pair("kmall_ignored_#SCL", "kmall ignored #SCL"),
        std::pair("line_points_outside_crs", "line points outside CRS"),
        std::pair("survey_", ""),
        std::pair("", "")})
    EXPECT_EQ(CounterInWords(name), words);
}

}  // namespace
}  // namespace seastitch
