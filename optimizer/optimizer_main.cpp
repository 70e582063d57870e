#include <chrono>
#include <cstdlib>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config_publisher.hpp"
#include "common/runtime/process/process.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/optimizer_node.hpp"

namespace {

// Without a sign of life; longer is reported.
constexpr double kJobMayTakeS = 1.9;

}  // namespace

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-optimizer",
      "Solves the pose graph of the submaps: GRAPH_UPDATE in, POSE_GRAPH out.",
      [](const ProcessArgs& args) {
        const auto config = LoadConfig(args, LoadOptimizerConfig);
        if (!config) return EXIT_SUCCESS;
        EventLoop loop;
        Bus bus(args.lcm_url);
        ThreadWorker worker(1);
        OptimizerNode node(*config, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked);
        loop.Add(worker.fd(), [&] { worker.Drain(); });
        node.health().WatchAge(
            "solve", conditions::kWorkerStalled, kJobMayTakeS, [&] { return worker.age_s(); });
        node.health().PublishEverySecond(&bus, &loop);
        ConfigPublisher configuration(
            ConfigParts("optimizer", {{"optimizer.yaml", PrintConfig(*config)}}), &bus);
        configuration.SendBy(&loop);
        loop.Add(bus.fd(), [&] {
          bus.HandleAll(Bus::kBurst);
          node.SolveWaiting();
        });
        loop.Every(std::chrono::milliseconds(500), [&] { node.EndStart(); });
        loop.Every(std::chrono::seconds(5), [&] { node.AskAgain(); });
        const int code = loop.Run();
        bus.HandleUntilQuiet();  // the mapper's last updates
        node.SolveWaiting();
        worker.Finish();  // and their solution
        return code;
      });
}
