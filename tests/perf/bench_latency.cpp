// From a sonar's datagrams on UDP to its pings on LCM: the real seastitch-mbes-driver at 1024 beams
// and 60 Hz, then the least that any driver could do with the same bytes (receive, copy, publish).
// Latency: from the kernel's stamp of the last datagram of a ping to that of its message on LCM.
// Usage (it needs a multicast route; `./run latency` makes one):
//   seastitch-bench-latency [SECONDS]      60 where not given

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "codecs/kongsberg/kmall_stream.hpp"
#include "common/runtime/bus.hpp"
#include "drivers/socket/file_descriptor.hpp"
#include "drivers/socket/receive.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "tools/live/child_process.hpp"

namespace seastitch {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr int kPort = 6020;
constexpr int kBeams = 1024;
constexpr int kPingsPerSecond = 60;
constexpr char kUrl[] = "udpm://239.255.76.67:7667?ttl=0";
constexpr char kPeerChannel[] = "PEER";

sockaddr_in Here() {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kPort);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Publishes each datagram behind its receive stamp (8 bytes). The first message, a stamp alone,
// says that it listens.
[[noreturn]] void RunPeer() {
  const FileDescriptor fd(socket(AF_INET, SOCK_DGRAM, 0));
  const sockaddr_in address = Here();
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    std::exit(EXIT_FAILURE);
  PrepareReceiving("peer", fd.get(), 16 * 1024 * 1024);
  Bus bus(kUrl);
  std::vector<std::uint8_t> datagram(65'536);
  std::vector<std::uint8_t> message(sizeof(std::int64_t));
  bus.PublishBytes(kPeerChannel, message.data(), message.size());
  std::uint32_t kernel_drops = 0;
  while (true) {
    pollfd waiting{fd.get(), POLLIN, 0};
    poll(&waiting, 1, -1);
    const ReceivedMessage received = ReceiveMessage(fd.get(), datagram, &kernel_drops);
    if (received.error != 0) continue;
    const std::int64_t stamp = ToUtime(received.recv);
    message.resize(sizeof stamp + received.size);
    std::memcpy(message.data(), &stamp, sizeof stamp);
    std::memcpy(message.data() + sizeof stamp, datagram.data(), received.size);
    bus.PublishBytes(kPeerChannel, message.data(), message.size());
  }
}

MbesPing PingNow(int number) {
  MbesPing ping;
  ping.time = FromUtime(std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::system_clock::now().time_since_epoch())
                            .count());
  ping.ping_number = static_cast<std::uint32_t>(number);
  ping.sound_speed_mps = 1500.0;
  for (int i = 0; i < kBeams; ++i) {
    MbesBeam beam;
    beam.rx_angle_rad = -1.0f + 2.0f * static_cast<float>(i) / (kBeams - 1);
    beam.twtt_s = 0.01f / std::cos(beam.rx_angle_rad);
    beam.flags = kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  return ping;
}

struct Sent {
  int pings = 0;
  int datagrams = 0;
};

Sent Send(int pings) {
  const FileDescriptor fd(socket(AF_INET, SOCK_DGRAM, 0));
  const sockaddr_in to = Here();
  Sent sent;
  const auto begin = SteadyClock::now();
  for (; sent.pings < pings; ++sent.pings) {
    const auto parts = SplitIntoParts(EncodeMrz(PingNow(sent.pings), KmallHeader{}));
    std::this_thread::sleep_until(begin + sent.pings * std::chrono::microseconds(1'000'000) /
                                              kPingsPerSecond);
    for (const std::vector<std::uint8_t>& part : parts) {
      sendto(
          fd.get(), part.data(), part.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
      ++sent.datagrams;
    }
  }
  return sent;
}

double ChildrensCpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// What came on LCM.
struct Heard {
  bool ready = false;
  std::vector<double> latency_ms;  // one a message
  std::int64_t published = 0;      // by the sender's own count, where it has one
  health_t health{};
};

void Subscribe(Bus* bus, Heard* heard) {
  bus->Subscribe<health_t>("HEALTH", 0, [heard](const health_t& message) {
    heard->ready = true;
    heard->health = message;
  });
  bus->SubscribeEvents(
      "MBES_PING", 0, [heard](const std::string&, const lcm::ReceiveBuffer& buffer) {
        mbes_ping_t ping{};
        if (ping.decode(buffer.data, 0, static_cast<int>(buffer.data_size)) < 0) return;
        heard->latency_ms.push_back(1e-3 *
                                    static_cast<double>(buffer.recv_utime - ping.recv_utime));
        heard->published = ping.seq + 1;
      });
  bus->SubscribeEvents(
      kPeerChannel, 0, [heard](const std::string&, const lcm::ReceiveBuffer& buffer) {
        heard->ready = true;
        std::int64_t stamp = 0;
        if (buffer.data_size <= sizeof stamp) return;
        std::memcpy(&stamp, buffer.data, sizeof stamp);
        heard->latency_ms.push_back(1e-3 * static_cast<double>(buffer.recv_utime - stamp));
      });
}

void HandleUntil(Bus* bus, const std::function<bool()>& done) {
  while (!done()) {
    pollfd waiting{bus->fd(), POLLIN, 0};
    if (poll(&waiting, 1, 100) > 0) bus->HandleReady();
  }
}

struct Figures {
  Sent sent;
  Heard heard;
  double cpu_percent = 0.0;  // of one core
};

Figures Measure(const std::vector<std::string>& command,
                const std::filesystem::path& output,
                int seconds) {
  Figures figures;
  Bus bus(kUrl);
  Subscribe(&bus, &figures.heard);
  const double cpu_before_s = ChildrensCpuSeconds();
  ChildProcess process("driver", command, output);
  const auto deadline = SteadyClock::now() + std::chrono::seconds(10);
  HandleUntil(&bus, [&] { return figures.heard.ready || SteadyClock::now() > deadline; });
  if (!figures.heard.ready) throw std::runtime_error(command[0] + ": nothing heard of it on LCM");

  std::atomic<bool> sending = true;
  std::thread sonar([&] {
    figures.sent = Send(seconds * kPingsPerSecond);
    sending = false;
  });
  HandleUntil(&bus, [&sending] { return !sending; });
  sonar.join();
  // What is still on its way, and one more HEALTH.
  const auto end = SteadyClock::now() + std::chrono::milliseconds(1500);
  HandleUntil(&bus, [end] { return SteadyClock::now() > end; });
  process.Stop(std::chrono::seconds(5));
  figures.cpu_percent = 100.0 * (ChildrensCpuSeconds() - cpu_before_s) / seconds;
  return figures;
}

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void Print(const char* name, std::int64_t sent, std::int64_t published, const Figures& f) {
  const std::vector<double>& ms = f.heard.latency_ms;
  std::printf("%-18s %8lld %9lld %6lld %9.3f %9.3f %9.3f %7.2f\n",
              name,
              static_cast<long long>(sent),
              static_cast<long long>(published),
              static_cast<long long>(sent - published),
              Quantile(ms, 0.5),
              Quantile(ms, 0.99),
              Quantile(ms, 1.0),
              f.cpu_percent);
}

void Main(const std::string& self, int seconds) {
  const std::filesystem::path dir =
      std::filesystem::temp_directory_path() / ("seastitch-latency-" + std::to_string(getpid()));
  std::filesystem::create_directories(dir);
  const std::filesystem::path config = dir / "mbes_driver.yaml";
  std::ofstream(config) << "format: kmall\nsource: udp:127.0.0.1:" << kPort << "\n";
  const std::string driver = (std::filesystem::path(self).parent_path() / "seastitch-mbes-driver");

  std::printf(
      "%d beams at %d Hz for %d s, KMALL; targets of the driver: nothing lost, p99 5 ms, "
      "CPU 15 %%\n\n%-18s %8s %9s %6s %9s %9s %9s %7s\n",
      kBeams,
      kPingsPerSecond,
      seconds,
      "",
      "sent",
      "published",
      "lost",
      "median ms",
      "p99 ms",
      "max ms",
      "CPU %");
  const Figures by_driver =
      Measure({driver, "--config", config, "--lcm-url", kUrl}, dir / "driver.txt", seconds);
  Print("driver, pings", by_driver.sent.pings, by_driver.heard.published, by_driver);
  const Figures by_peer = Measure({self, "--peer"}, dir / "peer.txt", seconds);
  Print("peer, datagrams",
        by_peer.sent.datagrams,
        static_cast<std::int64_t>(by_peer.heard.latency_ms.size()),
        by_peer);
  std::printf("\npings of the driver that this program did not hear: %lld\nits HEALTH:",
              static_cast<long long>(by_driver.heard.published) -
                  static_cast<long long>(by_driver.heard.latency_ms.size()));
  for (const counter_t& counter : by_driver.heard.health.counters)
    std::printf(" %s %lld", counter.name.c_str(), static_cast<long long>(counter.value));
  std::printf("\n");
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  if (argc > 1 && std::string(argv[1]) == "--peer") seastitch::RunPeer();
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");
  seastitch::Main(self, argc > 1 ? std::max(1, std::atoi(argv[1])) : 60);
  return EXIT_SUCCESS;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-bench-latency: %s\n", e.what());
  return EXIT_FAILURE;
}
