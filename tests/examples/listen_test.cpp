// The examples that listen to the bus, in C++ and in Python, beside one that sends.

#include <gtest/gtest.h>

#include "seastitch/health_t.hpp"
#include "seastitch/nav_corrected_t.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/support/run_command.hpp"

namespace seastitch {
namespace {

class Listen : public DriverProcess {
 protected:
  // Sends until the example has said both, or for 20 s. Returns what it said.
  std::string SendTo(const Process& example) {
    nav_corrected_t nav{};
    nav.utime = 1'763'806'500'000'000;
    nav.p_map_vehicle_m[0] = 12.345;
    nav.p_map_vehicle_m[1] = -6.0;
    nav.p_map_vehicle_m[2] = 30.0;
    condition_t fault{};
    fault.name = "no_bottom_lock";
    fault.sentence = "no bottom lock: for 5 s";
    health_t health{};
    health.process = "mapper";
    health.conditions = {fault};
    health.num_conditions = 1;
    const auto said = [&](const char* text) {
      return example.Output().find(text) != std::string::npos;
    };
    const bool both = HandleUntil(
        [&] {
          bus->Publish("NAV_CORRECTED", nav);
          bus->Publish("HEALTH", health);
          return said(kNav) && said(kFault);
        },
        20'000);
    EXPECT_TRUE(both) << example.Output();
    return example.Output();
  }
  static constexpr char kNav[] =
      "1763806500000000 us: north 12.35 m, east -6.00 m, depth 30.00 m\n";
  static constexpr char kFault[] = "mapper: no bottom lock: for 5 s\n";
};

TEST_F(Listen, InCppPrintsThePlaceAndTheFaults) {
  if (!OpenBus()) GTEST_SKIP() << "LCM cannot open " << lcm_url;
  const Process example(Program("listen"), {lcm_url}, dir / "cpp.txt");
  SendTo(example);
}

TEST_F(Listen, InPythonPrintsThePlaceAndTheFaults) {
  if (!OpenBus()) GTEST_SKIP() << "LCM cannot open " << lcm_url;
  const std::string source = SourceDir().string();
  const CommandResult types = RunCommand("lcm-gen --python --ppath " + dir.path().string() + " " +
                                         source + "/lcmtypes/*.lcm");
  ASSERT_EQ(types.exit_code, 0) << types.output;
  const std::string url = lcm_url.substr(sizeof "udpm://" - 1);
  const Process example("env",
                        {"PYTHONPATH=" + dir.path().string(),
                         "python3",
                         source + "/examples/listen.py",
                         url.substr(0, url.find('?'))},
                        dir / "python.txt");
  SendTo(example);
}

}  // namespace
}  // namespace seastitch
