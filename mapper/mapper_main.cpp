#include <chrono>
#include <cstdlib>
#include <thread>

#include "common/runtime/event_loop.hpp"
#include "common/runtime/freed_memory.hpp"
#include "common/runtime/process.hpp"
#include "mapper/mapper_node.hpp"

namespace {

// The node posts one job at a time.
constexpr std::size_t kWorkerQueue = 2;
// Between the last messages: 48 kB a message are then 24 MB/s, which every receiver follows.
constexpr std::chrono::milliseconds kPause(2);

// As the slowest inertial unit's messages would have it: 2.4 MB/s.
constexpr std::chrono::milliseconds kSendPeriod(20);

}  // namespace

int main(int argc, char** argv) {
  using namespace seastitch;
  KeepFreedMemory();
  return RunProcess(argc,
                    argv,
                    "seastitch-mapper",
                    "Dead reckoning, submaps and loop closures: sensor messages in, SUBMAP and "
                    "GRAPH_UPDATE out.",
                    [](const ProcessArgs& args) {
                      const MapperConfig config = LoadMapperConfig(args.config);
                      if (args.check_config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      ThreadWorker worker(kWorkerQueue);
                      MapperNode node(config, &bus, &worker);
                      loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
                      loop.Add(worker.fd(), [&] { worker.Drain(); });
                      loop.Every(kSendPeriod, [&] { node.SendWaiting(); });
                      node.health().PublishEverySecond(&bus, &loop);
                      const int code = loop.Run();
                      bus.HandleUntilQuiet();  // what the drivers sent before they stopped
                      node.Finish([] { std::this_thread::sleep_for(kPause); });
                      worker.Finish();
                      return code;
                    });
}
