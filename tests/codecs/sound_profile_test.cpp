#include "codecs/sound_profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "codecs/profile_text.hpp"

namespace seastitch {
namespace {

using Row = std::vector<ProfileRow>;

TEST(ProfileFrom, ReadsACastOnTheWayUpBackwards) {
  const auto profile = ProfileFrom(
      FromUtime(5), Row{{100.0, 1480.0}, {50.0, 1490.0}, {20.0, 1495.0}, {1.0, 1500.0}});
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->time, FromUtime(5));
  EXPECT_EQ(profile->depth_m, (std::vector<double>{1.0, 20.0, 50.0, 100.0}));
  EXPECT_EQ(profile->speed_mps, (std::vector<double>{1500.0, 1495.0, 1490.0, 1480.0}));
}

TEST(ProfileFrom, KeepsTheWayDownOfACastDownAndUp) {
  const auto profile = ProfileFrom(
      FromUtime(5),
      Row{{1.0, 1500.0}, {50.0, 1490.0}, {100.0, 1480.0}, {50.0, 1491.0}, {2.0, 1501.0}});
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->depth_m, (std::vector<double>{1.0, 50.0, 100.0}));
}

TEST(ProfileFrom, LosesOnlyTheRowsWithoutASoundSpeed) {
  const auto profile = ProfileFrom(
      FromUtime(5), Row{{0.0, 0.0}, {1.0, 1500.0}, {10.0, -99.0}, {20.0, 1490.0}, {30.0, 15.0}});
  ASSERT_TRUE(profile);
  EXPECT_EQ(profile->depth_m, (std::vector<double>{1.0, 20.0}));
  EXPECT_FALSE(ProfileFrom(FromUtime(5), Row{{1.0, 0.0}}));
  EXPECT_FALSE(ProfileFrom(FromUtime(5), Row{}));
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ProfileFrom(FromUtime(5), Row{{1.0, 1500.0}, {no_number, 1490.0}}));
}

// --- files of text
// ---------------------------------------------------------------------------------

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ProfileText, AsvpHasTheTimeOfItsHeader) {
  const ProfileText read = ParseProfileText(
      "( SoundVelocity 1.0 0 201505211456 22.49 -158.01 -1 0 0 OMS01050 P 0121 )\r\n"
      "0.00 1519.66\r\n10.50 1519.72\r\n12000.00 1650.10\r\n");
  EXPECT_EQ(read.problem, "");
  ASSERT_EQ(read.casts.size(), 1u);
  EXPECT_EQ(read.casts[0].time, FromUtime(1'432'220'160'000'000));
  EXPECT_THAT(read.casts[0].profile.depth_m, ElementsAre(0.0, 10.5, 12000.0));
  EXPECT_THAT(read.casts[0].profile.speed_mps, ElementsAre(1519.66, 1519.72, 1650.1));
}

TEST(ProfileText, CarisHasACastASection) {
  const ProfileText read = ParseProfileText(
      "[SVP_VERSION_2]\nline7.svp\n"
      "Section 2005-123 12:30:00 -37:34:12 -122:10:00\n0.5 1500.1\n20 1490\n"
      "Section 2005-124 00:00:01.5 -37:34:12 -122:10:00 Created by hand\n0 1501\n30 1489.5\n");
  EXPECT_EQ(read.problem, "");
  ASSERT_EQ(read.casts.size(), 2u);
  EXPECT_EQ(read.casts[0].time, FromUtime(1'115'123'400'000'000));
  EXPECT_EQ(read.casts[1].time, FromUtime(1'115'164'801'500'000));
  EXPECT_THAT(read.casts[1].profile.speed_mps, ElementsAre(1501.0, 1489.5));
}

TEST(ProfileText, TwoColumnsHaveNoTime) {
  for (const char* const text : {"0 1500\n10 1495\n",
                                 "# cast 3\ndepth,speed\n0,1500\n10,1495\n",
                                 "10.0;1495.0;8.1\n0.0;1500.0;9.3\n",
                                 "0,0;1500,0\n10,0;1495,0\n",
                                 "0,0\t1500,0\n10,0\t1495,0\n",
                                 "\"0\", \"1500\"\n\"10\", \"1495\"\n"}) {
    const ProfileText read = ParseProfileText(text);
    EXPECT_EQ(read.problem, "") << text;
    ASSERT_EQ(read.casts.size(), 1u) << text;
    EXPECT_FALSE(read.casts[0].time);
    EXPECT_THAT(read.casts[0].profile.depth_m, ElementsAre(0.0, 10.0)) << text;
    EXPECT_THAT(read.casts[0].profile.speed_mps, ElementsAre(1500.0, 1495.0)) << text;
  }
}

TEST(ProfileText, WhatCannotBeReadIsNamed) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "no row of depth and sound speed"},
      {"no number\n", "no row of depth and sound speed"},
      {"0 1500\nend of cast\n", "line 2: expected depth and sound speed"},
      {"0 4921\n30 4905\n",
       "a cast of fewer than two depths with a sound speed of sea water in m/s"},
      {"( SoundVelocity 1.0 0 20159921 )\n0 1500\n9 1490\n", "line 1: no time as in ( Sound"},
      {"[SVP_VERSION_2]\nx\nSection 2005-400 12:30\n0 1500\n9 1490\n",
       "line 3: no time as in Sec"}};
  for (const auto& [text, problem] : cases)
    EXPECT_THAT(ParseProfileText(text).problem, HasSubstr(problem)) << text;
}

TEST(ProfileText, NoTextHarms) {
  const std::string whole =
      "[SVP_VERSION_2]\nf\nSection 2005-123 12:30:00 a b\n0 1500\n9 1490\n"
      "( SoundVelocity 1.0 0 201505211456 1 2 )\n0 1500\n9,1490\n";
  std::mt19937 random(1);
  for (int i = 0; i < 20'000; ++i) {
    std::string text = whole;
    for (int n = 0; n < 4; ++n) text[random() % text.size()] = static_cast<char>(random() % 256);
    text.resize(random() % text.size());
    for (const ProfileCast& cast : ParseProfileText(text).casts) {
      EXPECT_GE(cast.profile.depth_m.size(), 2u);
      EXPECT_EQ(cast.profile.depth_m.size(), cast.profile.speed_mps.size());
    }
  }
}

}  // namespace
}  // namespace seastitch
