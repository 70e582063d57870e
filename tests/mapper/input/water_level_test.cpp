#include "mapper/input/water_level.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "mapper/mapper.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kStart = 1'777'716'000'000'000;  // 2026-05-02T10:00:00Z

Time At(double minutes) { return FromUtime(kStart) + FromSeconds(60.0 * minutes); }

std::string ErrorOf(const std::string& text) {
  try {
    WaterLevel::Parse(text, "tide.csv");
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(WaterLevel, MistakesAreNamedByTheirLine) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("tide.csv: no line TIME,METRES"));
  EXPECT_THAT(ErrorOf("time,level\n"), HasSubstr("no line TIME,METRES"));
  EXPECT_THAT(ErrorOf("2026-05-02T10:00:00Z,1.2\n2026-05-02T10:00:00Z,1.3\n"),
              HasSubstr("tide.csv:2: times must rise"));
  EXPECT_THAT(ErrorOf("# gauge\n2026-05-02T10:00:00Z,1.2\n2026-05-02T10:06:00Z,high\n"),
              HasSubstr("tide.csv:3: 'high' is not a number of metres"));
  EXPECT_THAT(ErrorOf("2026-05-02T10:00:00Z,1.2\n02.05.2026 10:06,1.3\n"),
              HasSubstr("tide.csv:2: '02.05.2026 10:06' is not a time"));
  EXPECT_THAT(ErrorOf("2026-05-02T10:00:00Z\n2026-05-02T10:06:00Z\n"), HasSubstr(":1: "));
  for (const char* time : {"2026-02-30T10:00",
                           "2026-05-02T24:00",
                           "2026-05-02T10:60",
                           "2026-05-02T10:00:61",
                           "2026-05-02T10:00:00+02:00",
                           "-5",
                           "1e300",
                           ""})
    EXPECT_THAT(ErrorOf("2026-01-01T00:00,1\n" + std::string(time) + ",1\n"), HasSubstr("is not a"))
        << time;
}

TEST(WaterLevel, FormsOfTimeAndColumnsAreTheSame) {
  for (const char* text : {"time,level\n2026-05-02T10:00:00Z,1.0\n2026-05-02T10:10:00Z,2.0\n",
                           "2026-05-02 10:00;+1.0\r\n2026-05-02 10:10;2.0\r\n",
                           "1777716000\t1.0\n1777716600.000\t2.0\n",
                           "#x\n2026-05-02T10:00:00.000, 1.0\n\n2026-05-02T10:10:00.0Z, 2.0"}) {
    const WaterLevel level = WaterLevel::Parse(text, "tide.csv");
    EXPECT_NEAR(level.At(At(0.0)), 1.0, 1e-12) << text;
    EXPECT_NEAR(level.At(At(2.5)), 1.25, 1e-9) << text;
    EXPECT_NEAR(level.At(At(10.0)), 2.0, 1e-12) << text;
  }
}

TEST(WaterLevel, FilesOfGaugesAreReadAsTheyAre) {
  for (const char* text :
       {// NOAA: sigma and flags; a gap; a line repeated
        "Date Time, Water Level, Sigma, O or I (for verified), F, R, L, Quality \n"
        "2026-05-02 10:00,1.0,0.005,0,0,0,0,v\n"
        "2026-05-02 10:00,1.0,0.005,0,0,0,0,v\n"
        "2026-05-02 10:06,,,1,1,1,1,v\n"
        "2026-05-02 10:10,2.0,0.004,0,0,0,0,v\n",
        "2026/05/02 10:00;1.0;x\n2026/05/02 10:10;2.0;\n",
        "2026-05-02T10:00:00+00:00,1.0\n2026-05-02T10:10:00.5+00:00,2.0\n"}) {
    const WaterLevel level = WaterLevel::Parse(text, "tide.csv");
    EXPECT_NEAR(level.At(At(0.0)), 1.0, 1e-12) << text;
    EXPECT_NEAR(level.At(At(5.0)), 1.5, 1e-3) << text;
    EXPECT_NEAR(level.At(At(11.0)), 2.0, 1e-12) << text;
  }
  EXPECT_THAT(ErrorOf("2026-05-02T10:00,1,25\n"), HasSubstr("'1,25' is not a number of metres"));
}

TEST(WaterLevel, OutsideItIsTheNearestAndSaysSo) {
  const WaterLevel level =
      WaterLevel::Parse("2026-05-02T10:00Z,1.0\n2026-05-02T10:10Z,2.0\n", "tide.csv");
  EXPECT_EQ(level.At(At(-100.0)), 1.0);
  EXPECT_EQ(level.At(At(100.0)), 2.0);
  EXPECT_TRUE(level.Covers(At(20.0), FromSeconds(3600.0)));
  EXPECT_FALSE(level.Covers(At(100.0), FromSeconds(3600.0)));
  EXPECT_FALSE(level.Covers(At(-100.0), FromSeconds(3600.0)));
  EXPECT_EQ(WaterLevel().At(At(0.0)), 0.0);
}

// A vehicle at 20 m below the water line, while the tide rises by half a metre in ten minutes.
class TidalDive : public testing::Test {
 protected:
  static MapperParams Params() {
    MapperParams params;
    params.navigation_source = NavigationSource::kGiven;
    params.vertical.water_level =
        WaterLevel::Parse("2026-05-02T10:00Z,1.0\n2026-05-02T10:10Z,1.5\n", "tide.csv");
    return params;
  }
  void Drive(double minutes, bool ins_has_depth) {
    for (const Time end = time_ + FromSeconds(60.0 * minutes); time_ < end;) {
      time_ += FromSeconds(0.5);
      NavigationSample ins;
      ins.time = time_;
      ins.position = GeoPosition{0.0, 0.0, {0.1, 0.1}};
      ins.attitude = Attitude{};
      ins.velocity = GeoVelocity{};
      if (ins_has_depth) ins.depth = InsVertical{20.0, 0.1};
      mapper.Add(ins);
      if (!ins_has_depth) mapper.Add(DepthSample{time_, std::nullopt, 20.0, 0.1});
      for (MapperEvent& event : mapper.TakeEvents())
        if (const auto* nav = std::get_if<NavState>(&event))
          depth_m = nav->T_map_vehicle.translation().z(), depth_time = nav->time;
    }
  }
  Mapper mapper{Params()};
  Time time_ = At(0.0);
  double depth_m = 0.0;
  Time depth_time;
};

TEST_F(TidalDive, DepthsCountFromTheZeroOfTheMap) {
  Drive(6.0, false);
  EXPECT_NEAR(depth_m, 20.0 - Params().vertical.water_level.At(depth_time), 1e-6);
  EXPECT_NEAR(depth_m, 18.7, 0.01);
}

TEST_F(TidalDive, ThoseOfAnInsToo) {
  Drive(6.0, true);
  EXPECT_NEAR(depth_m, 20.0 - Params().vertical.water_level.At(depth_time), 1e-6);
}

TEST_F(TidalDive, ATableOfAnotherDayIsSaid) {
  Drive(1.0, false);
  const auto holds = [this] {
    for (const Condition& condition : mapper.conditions())
      if (condition.kind == &conditions::kNoWaterLevel) return true;
    return false;
  };
  EXPECT_FALSE(holds());
  time_ += FromSeconds(86'400.0);
  Drive(1.0, false);
  EXPECT_TRUE(holds());
}

}  // namespace
}  // namespace seastitch
