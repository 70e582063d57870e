#include <cstdlib>

#include "common/runtime/event_loop.hpp"
#include "common/runtime/process.hpp"
#include "drivers/mbes/mbes_driver.hpp"

namespace {

using namespace seastitch;

int Run(const MbesDriverConfig& config, const std::string& lcm_url) {
  EventLoop loop;
  Bus bus(lcm_url);
  MbesDriver driver(config, &bus);
  UdpSocket socket(config.source, config.receive_buffer_bytes);
  const auto update_health = [&] {
    driver.UpdateHealth(socket.counters(), DeviceWatch::Clock::now(), socket.trouble());
  };
  Datagram datagram;
  loop.Add(socket.fd(), [&] {
    // Not until it is empty: signals and health want their turn in a flood.
    for (int i = 0; i < 64 && socket.Receive(&datagram); ++i) driver.Feed(datagram);
  });
  update_health();
  loop.Every(std::chrono::seconds(1), update_health);
  driver.health().PublishEverySecond(&bus, &loop);
  return loop.Run();
}

}  // namespace

int main(int argc, char** argv) {
  return RunProcess(argc,
                    argv,
                    "seastitch-mbes-driver",
                    "Multibeam sonar over UDP to MBES_PING, SVP and RAW_MBES",
                    [](const ProcessArgs& args) {
                      const MbesDriverConfig config = LoadMbesDriverConfig(args.config);
                      return args.check_config ? EXIT_SUCCESS : Run(config, args.lcm_url);
                    });
}
