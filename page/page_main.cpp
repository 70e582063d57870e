#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/process/process.hpp"
#include "page/page_node.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-page",
      "page of the vehicle for browsers: the map as it grows, position, faults",
      [](const ProcessArgs& args) {
        const auto config = LoadConfig(args, LoadPageConfig);
        if (!config) return EXIT_SUCCESS;
        EventLoop loop;
        Bus bus(args.lcm_url);
        PageNode node(*config, &bus);
        spdlog::info("page at http://{}:{}", ParseListenAddress(config->listen).host, node.port());
        ConfigPublisher configuration(ConfigParts(kPage, {{"page.yaml", PrintConfig(*config)}}),
                                      &bus);
        configuration.SendBy(&loop);
        loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
        node.Show();
        loop.Every(std::chrono::milliseconds(50), [&] { node.CatchUp(); });
        loop.Every(std::chrono::seconds(1), [&] { node.Show(); });
        node.health().PublishEverySecond(&bus, &loop);
        return loop.Run();
      });
}
