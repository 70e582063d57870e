// seastitch_health_monitor SECONDS PROCESS...: waits until the last HEALTH of each process is ok,
// at most so long. Prints the last of each. Exit status 0 if all were ok at once.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>

#include "seastitch/health_t.hpp"

namespace {

using States = std::map<std::string, seastitch::health_t>;

void Note(const lcm::ReceiveBuffer*,
          const std::string&,
          const seastitch::health_t* health,
          States* states) {
  const auto found = states->find(health->process);
  if (found != states->end()) found->second = *health;
}

bool AllOk(const States& states) {
  for (const auto& [process, health] : states)
    if (health.state != seastitch::health_t::STATE_OK) return false;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  States states;
  for (int i = 2; i < argc; ++i) states[argv[i]].state = seastitch::health_t::STATE_STARTING;
  lcm::LCM bus;
  bus.subscribeFunction("HEALTH", Note, &states);
  using std::chrono::steady_clock;
  const auto deadline =
      steady_clock::now() + std::chrono::seconds(argc > 1 ? std::atoi(argv[1]) : 0);
  while (!AllOk(states) && steady_clock::now() < deadline) bus.handleTimeout(100);
  for (const auto& [process, health] : states)
    std::printf("%s: state %d, %s\n",
                process.c_str(),
                static_cast<int>(health.state),
                health.seq == 0 && health.text.empty() ? "not heard" : health.text.c_str());
  return AllOk(states) ? EXIT_SUCCESS : EXIT_FAILURE;
}
