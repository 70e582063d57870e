// Stamps and positions of survey files that do not fit the others.
#include "survey/read/checked_reader.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "survey/read/survey_stream.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/small_kmall.hpp"

namespace seastitch {
namespace {

// Seconds after kNoon that pass, of records with these.
std::vector<double> Pass(const std::vector<double>& seconds, const std::string& source = "P1") {
  StampCheck check;
  std::vector<SurveyRecord> out;
  for (const double s : seconds) {
    NavigationRecord n;
    n.time = Kmall::At(s);
    n.source = source;
    check.Add(std::move(n), &out);
  }
  check.Finish(&out);
  EXPECT_EQ(check.left_out(), static_cast<std::int64_t>(seconds.size() - out.size()));
  std::vector<double> passed;
  for (const SurveyRecord& record : out) passed.push_back(ToSeconds(TimeOf(record) - Kmall::At(0)));
  return passed;
}

std::vector<double> Steady(int count, double from_s = 0.0, double step_s = 1.0) {
  std::vector<double> seconds;
  for (int i = 0; i < count; ++i) seconds.push_back(from_s + step_s * i);
  return seconds;
}

std::vector<double> Joined(std::vector<std::vector<double>> parts) {
  std::vector<double> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

constexpr double kDayS = 86'400.0;
constexpr double kEpochS = -1e-6 * kNoon;  // time 0 of the clock, from kNoon

TEST(StampCheck, OneWrongStampIsLeftOutWhereverItIs) {
  for (const double wrong_s : {kEpochS, -kDayS, kDayS, 300 * kDayS}) {
    for (const int count : {10, 1000}) {
      const std::vector<double> good = Steady(count);
      for (const std::ptrdiff_t at : {std::ptrdiff_t{0},
                                      std::ptrdiff_t{1},
                                      std::ptrdiff_t{5},
                                      std::ptrdiff_t{count - 1},
                                      std::ptrdiff_t{count}}) {
        std::vector<double> seconds = good;
        seconds.insert(seconds.begin() + at, wrong_s);
        EXPECT_EQ(Pass(seconds), good) << wrong_s << " at " << at << " of " << count;
      }
    }
  }
}

TEST(StampCheck, AWholeDatagramWithAWrongClockIsLeftOut) {
  const auto before = Steady(500), after = Steady(500, 501.0);
  const auto wrong = Steady(140, kDayS, 0.01);
  EXPECT_EQ(Pass(Joined({before, wrong, after})), Joined({before, after}));
  EXPECT_EQ(Pass(Joined({wrong, after})), after);
}

// A receiver without a fix, in every tenth record from the first on.
TEST(StampCheck, StampsThatAreWrongAgainAndAgainDoNotWin) {
  std::vector<double> seconds, good;
  for (int i = 0; i < 1000; ++i) {
    if (i % 10 == 0) seconds.push_back(kEpochS);
    seconds.push_back(0.5 * i);
    good.push_back(0.5 * i);
  }
  EXPECT_EQ(Pass(seconds), good);
}

TEST(StampCheck, PausesAndSparseRecordsPass) {
  for (const auto& good : {Joined({Steady(300), Steady(300, 7200.0)}),
                           Joined({Steady(3), Steady(300, 3600.0), Steady(3, 9000.0)}),
                           Joined({Steady(100), Steady(150, kDayS)}),
                           Steady(500, 0.0, 3600.0),
                           Steady(1),
                           Joined({Steady(1), Steady(1, 400.0)})})
    EXPECT_EQ(Pass(good), good);
}

// Lines of text navigation come when they come.
TEST(StampCheck, RecordsKeepTheirOrder) {
  const auto good = Joined({{0.0, 3.0, 1.0, 2.0}, Steady(400, 4.0)});
  EXPECT_EQ(Pass(good), good);
}

TEST(CheckedReader, NoPositionIsAtLatitudeAndLongitudeZero) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 8; ++i) {
    kmall.Motion(i).Ping(i + 0.5);
    if (i < 3)
      kmall.PositionAtZero(i);
    else
      kmall.Position(i);
  }
  const Played played({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(played.Count("survey_positions_at_zero"), 3);
  EXPECT_NEAR(Rad2Deg(played.survey.plan().vehicle.datum.latitude_rad), 57.0, 0.01);
}

// Seconds after kNoon of the pings that pass, of pings with these.
std::vector<double> PassPings(const std::vector<double>& seconds) {
  PingJumpCheck check;
  std::vector<SurveyRecord> out;
  for (const double s : seconds) {
    MbesPing ping;
    ping.time = Kmall::At(s);
    check.Add(std::move(ping), &out);
  }
  check.Finish(&out);
  EXPECT_EQ(check.left_out(), static_cast<std::int64_t>(seconds.size() - out.size()));
  std::vector<double> passed;
  for (const SurveyRecord& record : out) passed.push_back(ToSeconds(TimeOf(record) - Kmall::At(0)));
  return passed;
}

TEST(PingJumpCheck, StampsThatJumpAndComeBackAreLeftOut) {
  const auto before = Steady(100, 0.0, 0.25), after = Steady(100, 27.0, 0.25);
  for (const double jump_s : {20.0, -20.0, 6.0, -6.0, 50.0})
    for (const int pings : {1, 5})
      EXPECT_EQ(PassPings(Joined({before, Steady(pings, 25.0 + jump_s, 0.25), after})),
                Joined({before, after}))
          << pings << " by " << jump_s;
}

TEST(PingJumpCheck, PausesDeepWaterAndPartsInTheWrongOrderPass) {
  const auto line = Steady(100, 0.0, 0.25);
  for (const auto& seconds : {Joined({line, Steady(100, 60.0, 0.25)}),
                              Steady(50, 0.0, 15.0),
                              Joined({Steady(100, 1000.0, 0.25), line, Steady(100, 2000.0, 0.25)}),
                              Joined({line, Steady(3, 80.0, 0.25)}),
                              Steady(1)})
    EXPECT_EQ(PassPings(seconds), seconds);
}

}  // namespace
}  // namespace seastitch
