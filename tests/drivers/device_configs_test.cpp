// Every device that docs/drivers.md lists, by the configuration that is shipped for it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000;

TEST(DeviceConfigs, ShippedOnesLoad) {
  for (const char* const name : {"imu_driver.yaml", "imu_xsens_mti600.yaml", "imu_nmea2000.yaml"}) {
    Bus bus("memq://");
    BusOutput output(&bus);
    EXPECT_NO_THROW(ImuDriver(LoadImuDriverConfig(ConfigFile(name)), &output)) << name;
  }
  for (const char* const name : {"dvl_driver.yaml", "dvl_nmea2000.yaml"}) {
    Bus bus("memq://");
    BusOutput output(&bus);
    EXPECT_NO_THROW(DvlDriver(LoadDvlDriverConfig(ConfigFile(name)), &output)) << name;
  }
}

TEST(DeviceConfigs, UnknownDevicesAreOneLineWithTheKnownOnes) {
  const TemporaryDir dir;
  const std::string path = dir.Write("imu.yaml", "device: sundial\nsource: can:can0\n");
  try {
    LoadImuDriverConfig(path);
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("device: 'sundial' is not signals or nmea2000"));
  }
  const std::string clock =
      dir.Write("dvl.yaml", "device: nmea2000\nsource: can:can0\nclock: device\n");
  try {
    LoadDvlDriverConfig(clock);
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("clock: 'device' is not receive"));
  }
}

TEST(DeviceConfigs, Pd0EnsemblesBecomeDvlAndRaw) {
  Bus bus("memq://");
  BusOutput output(&bus);
  std::vector<dvl_t> velocities;
  std::vector<raw_bytes_t> raw;
  bus.Subscribe<dvl_t>("DVL", 0, [&](const dvl_t& msg) { velocities.push_back(msg); });
  bus.Subscribe<raw_bytes_t>("RAW_DVL", 0, [&](const raw_bytes_t& msg) { raw.push_back(msg); });
  Pd0DriverConfig config = LoadPd0DriverConfig(ConfigFile("dvl_pd0.yaml"));
  config.pd0.clock.clock = DeviceClock::kDevice;
  Pd0Driver driver(config, &output);
  std::vector<std::vector<std::uint8_t>> sent;
  for (int i = 0; i < 5; ++i) {
    DvlSample sample;
    sample.time = FromUtime(kStart + 200'000 * i);
    sample.bottom_lock = i != 3;
    sample.v_dvl_mps = {1.5, 0.0, 0.0};
    for (DvlBeam& beam : sample.beams) beam = {true, 20.0, 0.0};
    Pd0Ensemble ensemble = ToPd0Ensemble(sample, config.pd0);
    ensemble.number = static_cast<std::uint16_t>(i);
    sent.push_back(EncodePd0(ensemble));
    driver.Feed({sent.back(), sample.time + Duration(90'000), 7});
  }
  driver.Feed({{1, 2, 3}, FromUtime(kStart), 7});
  driver.UpdateHealth({}, {});
  bus.HandleAll();
  ASSERT_EQ(velocities.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(velocities[i].utime, kStart + 200'000 * static_cast<std::int64_t>(i));
    EXPECT_EQ(velocities[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(velocities[i].bottom_lock, i != 3);
    EXPECT_TRUE(FromLcm(velocities[i]));
    EXPECT_EQ(raw[i].data, sent[i]);
  }
  EXPECT_EQ(raw.size(), 6u);
  EXPECT_EQ(driver.health().counter("pd0_malformed"), 1);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
}

}  // namespace
}  // namespace seastitch
