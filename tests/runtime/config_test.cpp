#include "common/runtime/config/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/pose.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

struct Thing {
  double a = 1.0;
  int n = 3;
  unsigned long seed = 1;
  bool flag = false;
  std::string name = "x";
  std::vector<double> list;
  Eigen::Vector2d angles_rad{Deg2Rad(0.1), Deg2Rad(0.7)};
  double voxel_m = 0.25;
  double min_support = 0.1;
};

ParameterTable TableOf(Thing* t) {
  ParameterTable table;
  table.Add("a", &t->a, Unit::kNone, Range::Any(), "A number.");
  table.Add("n", &t->n, Unit::kNone, Range::Within(0, 9), "A whole number.");
  table.Add("seed", &t->seed, Unit::kNone, Range::Any(), "Another.");
  table.Add("flag", &t->flag, "A flag.");
  table.Add("name", &t->name, "A text.");
  table.Add("list", &t->list, Unit::kNone, Range::AtLeast(0.0), "Numbers.");
  table.Add(
      "angles_deg", &t->angles_rad, Unit::kDegreeFromRadian, Range::Any().Below(90.0), "Angles.");
  ParameterTable& submap = table.AddSection("submap", "A section.");
  submap.Add("voxel_m", &t->voxel_m, Unit::kMetre, Range::Above(0.0).AtMost(10.0), "An edge.")
      .DataSheet();
  // A key that stands in kRenamedKeys.
  table.AddSection("filter", "Another section.")
      .Add("min_support_fraction", &t->min_support, Unit::kNone, Range::Above(0.0), "A share.");
  return table;
}

class ConfigTest : public testing::Test {
 protected:
  Thing Load(const std::string& text) {
    Thing thing;
    LoadParameters(dir_.Write("m.yaml", text), TableOf(&thing));
    return thing;
  }

  // What the error says after the directory.
  std::string ErrorOf(const std::string& text) {
    try {
      Load(text);
    } catch (const ConfigError& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.find('\n'), std::string::npos) << "one line";
      return what.substr(dir_.path().string().size() + 1);
    }
    return "no error";
  }

  TemporaryDir dir_;
};

TEST_F(ConfigTest, ReadsWhatIsThereAndKeepsTheDefaultOfWhatIsNot) {
  const Thing thing = Load("n: 5\nflag: yes\nlist: [1, 2]\nsubmap: {voxel_m: 0.5}\n");
  EXPECT_EQ(thing.a, 1.0);
  EXPECT_EQ(thing.n, 5);
  EXPECT_TRUE(thing.flag);
  EXPECT_EQ(thing.name, "x");
  EXPECT_THAT(thing.list, testing::ElementsAre(1.0, 2.0));
  EXPECT_EQ(thing.voxel_m, 0.5);
}

TEST_F(ConfigTest, ReadsDegreesToRadians) {
  EXPECT_EQ(Load("angles_deg: [-45, 0.4]").angles_rad,
            Eigen::Vector2d(Deg2Rad(-45.0), Deg2Rad(0.4)));
}

TEST_F(ConfigTest, NamesFileKeyValueAndExpectation) {
  EXPECT_EQ(ErrorOf("submap: {voxel_m: wide}"),
            "m.yaml: submap.voxel_m: 'wide' is not a number above 0, at most 10");
  EXPECT_EQ(ErrorOf("n: 1.5"), "m.yaml: n: '1.5' is not a whole number from 0 to 9");
  EXPECT_EQ(ErrorOf("n: 99999999999"),
            "m.yaml: n: '99999999999' is not a whole number from 0 to 9");
  EXPECT_EQ(ErrorOf("seed: -1"), "m.yaml: seed: '-1' is not a whole number");
  EXPECT_EQ(ErrorOf("flag: 2"), "m.yaml: flag: '2' is not true or false");
  EXPECT_EQ(ErrorOf("name: {a: 1}"), "m.yaml: name: a map is not a text");
  EXPECT_EQ(ErrorOf("a: [1, 2]"), "m.yaml: a: '[1, 2]' is not a number");
  EXPECT_EQ(ErrorOf("angles_deg: [1]"),
            "m.yaml: angles_deg: '[1]' is not 2 numbers, each below 90");
  EXPECT_EQ(ErrorOf("submap: 3"), "m.yaml: submap: '3' is not a map");
}

TEST_F(ConfigTest, TakesNoNanNoInfinityAndNoEmptyValueForANumber) {
  EXPECT_EQ(ErrorOf("a: .nan"), "m.yaml: a: '.nan' is not a number");
  EXPECT_EQ(ErrorOf("a: -.inf"), "m.yaml: a: '-.inf' is not a number");
  EXPECT_EQ(ErrorOf("a:"), "m.yaml: a: an empty value is not a number");
  EXPECT_EQ(ErrorOf("name:"), "m.yaml: name: an empty value is not a text");
  EXPECT_EQ(ErrorOf("list: [1, .inf]"),
            "m.yaml: list: '[1, .inf]' is not a list of numbers, each at least 0");
}

TEST_F(ConfigTest, CutsAnEndlessValueShort) {
  EXPECT_LT(ErrorOf("a: " + std::string(5000, 'x')).size(), 150u);
}

TEST_F(ConfigTest, RefusesUnknownAndDoubledKeys) {
  EXPECT_EQ(ErrorOf("submap: {voxel: 1}"),
            "m.yaml: submap.voxel: unknown key; did you mean 'voxel_m'?");
  EXPECT_EQ(ErrorOf("b: 1"), "m.yaml: b: unknown key");
  EXPECT_EQ(ErrorOf("submap: {voxel_m: 1, voxel_m: 2}"), "m.yaml: voxel_m: stands twice");
}

TEST_F(ConfigTest, ReadsAnEarlierNameButNotBoth) {
  EXPECT_EQ(Load("filter: {min_support_part: 2}").min_support, 2.0);
  EXPECT_EQ(ErrorOf("filter: {min_support_part: 1, min_support_fraction: 2}"),
            "m.yaml: filter.min_support_part: is the earlier name of min_support_fraction, which "
            "stands too");
}

TEST_F(ConfigTest, PrintsWhatIsReadAsTheSame) {
  Thing thing;
  thing.a = 0.1 + 0.2;
  thing.angles_rad = {Deg2Rad(12.3), Deg2Rad(-1e-7)};
  thing.name = "null: \"#*\"";
  thing.list = {1e-300, 4e9};
  const std::string text = PrintWithDefaults(thing, {});
  const Thing again = Load(text);
  EXPECT_EQ(again.a, thing.a);
  EXPECT_EQ(again.angles_rad, thing.angles_rad);
  EXPECT_EQ(again.name, thing.name);
  EXPECT_EQ(again.list, thing.list);
  EXPECT_THAT(text, HasSubstr("# A number. Default 1.\na: 0.30000000000000004\n"));
  EXPECT_THAT(text, HasSubstr("  # An edge. Above 0, at most 10.\n  voxel_m: 0.25\n"));
  EXPECT_LT(text.find("voxel_m:"), text.find("flag:")) << "the data sheet comes first";
}

TEST_F(ConfigTest, TellsTheLineOfASyntaxError) {
  EXPECT_THAT(ErrorOf("a: 1\nb: [1, 2\nc: 3\n"),
              AllOf(HasSubstr("m.yaml:3: not YAML: "), Not(HasSubstr("\n"))));
}

TEST_F(ConfigTest, RefusesWhatIsNoFileOrNoMap) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("expected a map of keys"));
  EXPECT_THAT(ErrorOf("- 1\n"), HasSubstr("expected a map of keys"));
  EXPECT_NO_THROW(Load("{}"));
  Thing thing;
  EXPECT_THROW(LoadParameters((dir_.path() / "absent.yaml").string(), TableOf(&thing)),
               ConfigError);
  EXPECT_THROW(LoadParameters(dir_.path().string(), TableOf(&thing)), ConfigError);
}

TEST_F(ConfigTest, SurvivesAFileThatContainsItself) {
  EXPECT_THAT(ErrorOf("a: &a [*a]\n"), HasSubstr("nested too deeply"));
}

TEST(VehicleConfig, ShippedFileLoads) {
  const VehicleGeometry vehicle = LoadVehicle(ConfigFile("vehicle.yaml"));
  EXPECT_TRUE(vehicle.T_mbes_tx.isApprox(Eigen::Isometry3d::Identity()));
}

TEST_F(ConfigTest, VehicleMayHaveTheSonarsArraysApart) {
  const std::string path = dir_.Write(
      "vehicle.yaml",
      "{datum: {latitude_deg: 1, longitude_deg: 2}, mbes_transmitter: {position_m: [-0.5, 0, 0.1],"
      " roll_pitch_yaw_deg: [0, 0, 180]}, mbes_receiver: {position_m: [0.1, 0, 0]}}");
  const VehicleGeometry vehicle = LoadVehicle(path);
  EXPECT_EQ(vehicle.T_mbes_tx.translation().x(), -0.5);
  EXPECT_NEAR(vehicle.T_mbes_tx.linear()(0, 0), -1.0, 1e-12);
  EXPECT_EQ(vehicle.T_mbes_rx.translation().x(), 0.1);
  EXPECT_TRUE(vehicle.p_tx_parts_m.empty());
}

TEST_F(ConfigTest, TransmitterMayHaveParts) {
  VehicleGeometry vehicle;
  vehicle.p_tx_parts_m = {{0.0, -0.0554, -0.012}, {0.0, 0.013, -0.006}, {0.0, 0.0554, -0.012}};
  vehicle.more_heads.resize(2);
  vehicle.more_heads[1].p_tx_parts_m = {{0.01, 0.02, 0.03}};
  const std::string path = dir_.Write("vehicle.yaml", PrintConfig(vehicle));
  const VehicleGeometry again = LoadVehicle(path);
  EXPECT_EQ(again.p_tx_parts_m, vehicle.p_tx_parts_m);
  EXPECT_EQ(again.Head(0).p_tx_parts_m, vehicle.p_tx_parts_m);
  EXPECT_TRUE(again.Head(1).p_tx_parts_m.empty());
  EXPECT_EQ(again.Head(2).p_tx_parts_m, vehicle.more_heads[1].p_tx_parts_m);
  const std::string datum = "datum: {latitude_deg: 1, longitude_deg: 2}, ";
  const std::string misspelt = dir_.Write(
      "vehicle.yaml", "{" + datum + "mbes_transmitter: {parts: [{postion_m: [0, 0.05, 0]}]}}");
  EXPECT_THROW(LoadVehicle(misspelt), ConfigError);
}

}  // namespace
}  // namespace seastitch
