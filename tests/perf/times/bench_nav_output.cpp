// From NAV_CORRECTED on LCM to its sentences on UDP: the real seastitch-nav-output at 10 Hz, then
// the least that any program could do (receive, send a datagram). Latency: from the call that
// publishes the message to the kernel's stamp of the datagram.
// Usage (it needs a multicast route; `./run latency` makes one):
//   seastitch-bench-nav-output [SECONDS]      60 where not given

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "drivers/output/byte_sink.hpp"
#include "drivers/socket/udp_socket.hpp"
#include "seastitch/nav_corrected_t.hpp"
#include "tests/support/paths.hpp"
#include "tools/live/child_process.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr char kUrl[] = "udpm://239.255.76.67:7667?ttl=0";
constexpr char kPort[] = "udp:127.0.0.1:10111";
constexpr std::chrono::milliseconds kPeriod(100);

[[noreturn]] void RunPeer() {
  Bus bus(kUrl);
  const std::unique_ptr<ByteSink> sink = OpenByteSink(kPort);
  bus.Subscribe<nav_corrected_t>(
      "NAV_CORRECTED", 0, [&](const nav_corrected_t&) { sink->Send("$INHDT,0.00,T*00\r\n"); });
  while (true) bus.HandleReady();
}

void Measure(const char* name, const std::vector<std::string>& command, int seconds) {
  UdpSocket socket(kPort, 1 << 20);
  Bus bus(kUrl);
  ChildProcess process(name, command, "/dev/null");
  Datagram datagram;
  nav_corrected_t nav{};
  nav.q_map_vehicle[0] = 1.0;
  std::vector<double> ms;
  int sent = 0;
  const auto begin = std::chrono::steady_clock::now() + std::chrono::seconds(1);  // it starts
  for (; sent < seconds * 1000 / kPeriod.count(); ++sent) {
    std::this_thread::sleep_until(begin + sent * kPeriod);
    nav.utime = NowUtime();
    ++nav.seq;
    bus.Publish("NAV_CORRECTED", nav);
    pollfd waiting{socket.fd(), POLLIN, 0};
    if (poll(&waiting, 1, 90) > 0 && socket.Receive(&datagram))
      ms.push_back(1e-3 * static_cast<double>(ToUtime(datagram.recv) - nav.utime));
  }
  process.Stop(std::chrono::seconds(5));
  std::sort(ms.begin(), ms.end());
  const auto quantile = [&ms](double q) {
    return ms.empty() ? -1.0 : ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1))];
  };
  std::printf("%-12s %6d %6zu %9.3f %9.3f %9.3f\n",
              name,
              sent,
              ms.size(),
              quantile(0.5),
              quantile(0.99),
              quantile(1.0));
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  using namespace seastitch;
  if (argc > 1 && std::string(argv[1]) == "--peer") RunPeer();
  const int seconds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 60;
  const std::string self = fs::read_symlink("/proc/self/exe");
  const fs::path config =
      fs::temp_directory_path() / ("nav_output-" + std::to_string(getpid()) + ".yaml");
  // Every NAV has a sentence.
  std::ofstream(config) << "vehicle: " << ConfigFile("vehicle.yaml") << "\nudp: \"" << kPort
                        << "\"\nrates: {hdt_hz: 10}\n";
  std::printf("NAV_CORRECTED at 10 Hz for %d s; target p99 20 ms\n\n%-12s %6s %6s %9s %9s %9s\n",
              seconds,
              "",
              "sent",
              "heard",
              "median ms",
              "p99 ms",
              "max ms");
  Measure("nav-output",
          {Program("seastitch-nav-output"), "--config", config, "--lcm-url", kUrl},
          seconds);
  Measure("peer", {self, "--peer"}, seconds);
  fs::remove(config);
  return EXIT_SUCCESS;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-bench-nav-output: %s\n", e.what());
  return EXIT_FAILURE;
}
