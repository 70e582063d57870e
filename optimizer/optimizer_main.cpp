#include <chrono>
#include <cstdlib>

#include "common/runtime/process.hpp"
#include "optimizer/optimizer_node.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(argc,
                    argv,
                    "seastitch-optimizer",
                    "Solves the pose graph of the submaps: GRAPH_UPDATE in, POSE_GRAPH out.",
                    [](const ProcessArgs& args) {
                      const OptimizerConfig config = LoadOptimizerConfig(args.config);
                      if (args.check_config) return EXIT_SUCCESS;
                      EventLoop loop;
                      Bus bus(args.lcm_url);
                      ThreadWorker worker(1);
                      OptimizerNode node(config, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked);
                      loop.Add(worker.fd(), [&] { worker.Drain(); });
                      node.health().PublishEverySecond(&bus, &loop);
                      loop.Add(bus.fd(), [&] {
                        bus.HandleAll(Bus::kBurst);
                        node.SolveWaiting();
                      });
                      loop.Every(std::chrono::seconds(5), [&] { node.AskAgain(); });
                      return loop.Run();
                    });
}
