#include "common/runtime/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "common/runtime/vehicle_config.hpp"
#include "tests/paths.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

class ConfigMapTest : public testing::Test {
 protected:
  ConfigMap Load(const std::string& text) { return ConfigMap::Load(dir_.Write("m.yaml", text)); }

  // What the error says after the directory.
  std::string ErrorOf(const std::string& text, const std::function<void(ConfigMap&)>& read) {
    try {
      ConfigMap map = Load(text);
      read(map);
    } catch (const ConfigError& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.find('\n'), std::string::npos) << "one line";
      return what.substr(dir_.path().string().size() + 1);
    }
    return "no error";
  }

  template <class T>
  std::string ErrorOfReading(const std::string& value) {
    return ErrorOf("submap:\n  voxel_m: " + value + "\n", [](ConfigMap& root) {
      T number{};
      root.Child("submap").Read("voxel_m", &number);
    });
  }

  TemporaryDir dir_;
};

TEST_F(ConfigMapTest, ReadsWhatIsThereAndKeepsTheDefaultOfWhatIsNot) {
  ConfigMap root = Load("a: 1.5\nflag: yes\nname: x\nlist: [1, 2]\nsub: {n: 3}\n");
  double a = 0.0;
  double absent = 7.0;
  bool flag = false;
  std::string name;
  std::vector<double> list;
  int n = 0;
  root.Read("a", &a);
  root.Read("absent", &absent);
  root.Read("flag", &flag);
  root.Require("name", &name);
  root.Read("list", &list);
  ConfigMap sub = root.Child("sub");
  sub.Read("n", &n);
  sub.Finish();
  root.Finish();
  EXPECT_EQ(a, 1.5);
  EXPECT_EQ(absent, 7.0);
  EXPECT_TRUE(flag);
  EXPECT_EQ(name, "x");
  EXPECT_THAT(list, testing::ElementsAre(1.0, 2.0));
  EXPECT_EQ(n, 3);
}

TEST_F(ConfigMapTest, NamesFileKeyValueAndExpectation) {
  EXPECT_EQ(ErrorOfReading<double>("wide"), "m.yaml: submap.voxel_m: 'wide' is not a number");
  EXPECT_EQ(ErrorOfReading<int>("1.5"), "m.yaml: submap.voxel_m: '1.5' is not a whole number");
  EXPECT_EQ(ErrorOfReading<unsigned>("-1"), "m.yaml: submap.voxel_m: '-1' is not a whole number");
  EXPECT_EQ(ErrorOfReading<bool>("2"), "m.yaml: submap.voxel_m: '2' is not true or false");
  EXPECT_EQ(ErrorOfReading<std::string>("{a: 1}"), "m.yaml: submap.voxel_m: a map is not a text");
  EXPECT_EQ(ErrorOfReading<double>("[1, 2]"), "m.yaml: submap.voxel_m: '[1, 2]' is not a number");
}

TEST_F(ConfigMapTest, TakesNoNanNoInfinityAndNoEmptyValueForANumber) {
  EXPECT_EQ(ErrorOfReading<double>(".nan"), "m.yaml: submap.voxel_m: '.nan' is not a number");
  EXPECT_EQ(ErrorOfReading<double>("-.inf"), "m.yaml: submap.voxel_m: '-.inf' is not a number");
  EXPECT_EQ(ErrorOfReading<double>(""), "m.yaml: submap.voxel_m: an empty value is not a number");
  EXPECT_EQ(ErrorOfReading<std::string>(""),
            "m.yaml: submap.voxel_m: an empty value is not a text");
  EXPECT_EQ(ErrorOfReading<std::vector<double>>("[1, .inf]"),
            "m.yaml: submap.voxel_m: '[1, .inf]' is not of the expected shape");
}

TEST_F(ConfigMapTest, CutsAnEndlessValueShort) {
  EXPECT_LT(ErrorOfReading<double>(std::string(5000, 'x')).size(), 150u);
}

TEST_F(ConfigMapTest, RefusesUnknownMissingAndDoubledKeys) {
  EXPECT_EQ(
      ErrorOf("submap: {voxel_size: 1}", [](ConfigMap& root) { root.Child("submap").Finish(); }),
      "m.yaml: submap.voxel_size: unknown key");
  EXPECT_EQ(ErrorOf("a: 1", [](ConfigMap& root) { root.Finish(); }), "m.yaml: a: unknown key");
  EXPECT_EQ(ErrorOf("a: 1",
                    [](ConfigMap& root) {
                      int b = 0;
                      root.Require("b", &b);
                    }),
            "m.yaml: b: missing");
  EXPECT_EQ(ErrorOf("a: {b: 1, c: 2, b: 3}", [](ConfigMap&) {}), "m.yaml: b: stands twice");
}

TEST_F(ConfigMapTest, TellsTheLineOfASyntaxError) {
  EXPECT_THAT(ErrorOf("a: 1\nb: [1, 2\nc: 3\n", [](ConfigMap&) {}),
              AllOf(HasSubstr("m.yaml:3: not YAML: "), Not(HasSubstr("\n"))));
}

TEST_F(ConfigMapTest, RefusesWhatIsNoFileOrNoMap) {
  EXPECT_THAT(ErrorOf("", [](ConfigMap&) {}), HasSubstr("expected a map of keys"));
  EXPECT_THAT(ErrorOf("- 1\n", [](ConfigMap&) {}), HasSubstr("expected a map of keys"));
  EXPECT_NO_THROW(Load("{}").Finish());
  EXPECT_THROW(ConfigMap::Load((dir_.path() / "absent.yaml").string()), ConfigError);
  EXPECT_THROW(ConfigMap::Load(dir_.path().string()), ConfigError);
}

TEST_F(ConfigMapTest, SurvivesAFileThatContainsItself) {
  EXPECT_THAT(ErrorOf("a: &a [*a]\n", [](ConfigMap&) {}), HasSubstr("nested too deeply"));
}

TEST_F(ConfigMapTest, NamesTheElementOfAList) {
  const std::string text = "sources:\n  - {port: 1}\n  - {port: one}\n";
  EXPECT_EQ(ErrorOf(text,
                    [](ConfigMap& root) {
                      for (ConfigMap& source : root.Children("sources")) {
                        int port = 0;
                        source.Read("port", &port);
                      }
                    }),
            "m.yaml: sources[1].port: 'one' is not a whole number");
  EXPECT_EQ(ErrorOf("sources: 3", [](ConfigMap& root) { root.Children("sources"); }),
            "m.yaml: sources: '3' is not a list");
}

TEST_F(ConfigMapTest, GivesKeysInTheOrderOfTheFile) {
  EXPECT_THAT(Load("z: 1\na: 2\nm: 3\n").Keys(), testing::ElementsAre("z", "a", "m"));
}

TEST_F(ConfigMapTest, PutsAProblemOfValidateBehindThePath) {
  EXPECT_EQ(
      ErrorOf("submap: {}",
              [](ConfigMap& root) { root.Child("submap").Check("voxel_m = -1, must be > 0"); }),
      "m.yaml: submap.voxel_m = -1, must be > 0");
  EXPECT_NO_THROW(Load("{}").Check(""));
}

TEST(VehicleConfig, ShippedFileLoads) {
  const VehicleGeometry vehicle = LoadVehicle(ConfigFile("vehicle.yaml"));
  EXPECT_TRUE(vehicle.T_mbes_tx.isApprox(Eigen::Isometry3d::Identity()));
}

TEST_F(ConfigMapTest, VehicleMayHaveTheSonarsArraysApart) {
  Load(
      "{datum: {latitude_deg: 1, longitude_deg: 2}, mbes_transmitter: {position_m: [-0.5, 0, 0.1],"
      " roll_pitch_yaw_deg: [0, 0, 180]}, mbes_receiver: {position_m: [0.1, 0, 0]}}");
  const VehicleGeometry vehicle = LoadVehicle((dir_.path() / "m.yaml").string());
  EXPECT_EQ(vehicle.T_mbes_tx.translation().x(), -0.5);
  EXPECT_NEAR(vehicle.T_mbes_tx.linear()(0, 0), -1.0, 1e-12);
  EXPECT_EQ(vehicle.T_mbes_rx.translation().x(), 0.1);
}

}  // namespace
}  // namespace seastitch
