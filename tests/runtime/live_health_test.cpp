// HEALTH as others see it: from a running loop, over memq and over real sockets.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/health.hpp"
#include "common/runtime/worker.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "tests/runtime/notify_socket.hpp"

namespace seastitch {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::Not;

constexpr ConditionKind kFault{"fault", Severity::kDegraded, "a fault", "wait"};

std::int64_t Counter(const health_t& msg, const std::string& name) {
  for (const counter_t& counter : msg.counters)
    if (counter.name == name) return counter.value;
  return -1;
}

bool Holds(const health_t& msg, const ConditionKind& kind) {
  return std::any_of(msg.conditions.begin(), msg.conditions.end(), [&](const condition_t& c) {
    return c.name == kind.name;
  });
}

// A bus of this test process alone: others run beside it.
int UdpPort() { return 20'000 + getpid() % 40'000; }
std::string UdpUrl() { return "udpm://239.255.76.67:" + std::to_string(UdpPort()) + "?ttl=0"; }

// A process of one loop, whose HEALTH comes back to it. It gives up after 30 s.
class LiveHealth : public testing::Test {
 protected:
  void Open(const std::string& url) {
    bus.emplace(url);
    bus->Subscribe<health_t>("HEALTH", 0, [this](const health_t& msg) {
      messages.push_back(msg);
      if (done && done(msg)) loop.Stop();
    });
    loop.Add(bus->fd(), [this] { bus->HandleAll(Bus::kBurst); });
    health.PublishEverySecond(&*bus, &loop);
    loop.Every(std::chrono::seconds(30), [this] {
      ADD_FAILURE() << "never came; last: "
                    << (messages.empty() ? "nothing" : messages.back().text);
      loop.Stop();
    });
  }
  const health_t& RunUntil(std::function<bool(const health_t&)> is_done) {
    done = std::move(is_done);
    loop.Run();
    static const health_t kNothing{};
    return messages.empty() ? kNothing : messages.back();
  }

  EventLoop loop;
  std::optional<Bus> bus;
  Health health{"test"};
  std::vector<health_t> messages;
  std::function<bool(const health_t&)> done;
};

TEST_F(LiveHealth, ComesWithoutAnyData) {
  Open("memq://");
  health.SetRunning();
  const health_t last = RunUntil([this](const health_t&) { return messages.size() == 3; });
  EXPECT_EQ(last.state, health_t::STATE_OK);
  EXPECT_EQ(last.seq, 2);
}

TEST_F(LiveHealth, ComesAtOnceWhenTheStateChangesAndFlappingDoesNotFloodTheBus) {
  Open("memq://");
  health.SetRunning();
  std::int64_t changes = 0;
  // By chance, not by turns: an even number of turns between two looks would hide them all.
  std::minstd_rand random(1);
  loop.Every(milliseconds(1), [&] {
    ++changes;
    health.HoldIf(random() % 2 == 0, kFault);
  });
  RunUntil([](const health_t& msg) { return msg.uptime_s > 3.0; });
  EXPECT_GT(changes, 200);
  const double uptime_s = messages.back().uptime_s;
  EXPECT_GT(messages.size(), 4u) << "more often than once a second";
  EXPECT_LT(static_cast<double>(messages.size()), 10.0 * uptime_s + 2.0);
}

TEST_F(LiveHealth, NamesGarbageOnEveryChannel) {
  Open("memq://");
  health.SetStarting("waiting for navigation");
  bus->Subscribe<imu_t>("IMU", 0, [](const imu_t&) {});
  bus->Subscribe<dvl_t>("DVL", 0, [](const dvl_t&) {});
  for (int i = 0; i < 12; ++i) bus->PublishBytes("IMU", "garbage", 7);
  bus->Publish("DVL", raw_bytes_t{});
  const health_t msg =
      RunUntil([](const health_t& m) { return Holds(m, conditions::kUndecodableMessages); });
  EXPECT_EQ(msg.state, health_t::STATE_DEGRADED);
  EXPECT_THAT(msg.text, HasSubstr("12 on IMU"));
  EXPECT_THAT(msg.text, HasSubstr("1 on DVL"));
  EXPECT_THAT(msg.text, HasSubstr("waiting for navigation"));
  EXPECT_EQ(Counter(msg, "undecodable_IMU"), 12);
  EXPECT_EQ(Counter(msg, "bus_decode_errors"), 13);
}

TEST_F(LiveHealth, AWorkerThatHangsIsNamedAndFeedsTheWatchdog) {
  NotifySocket notify;
  Open("memq://");
  health.SetRunning();
  ThreadWorker worker(1);
  health.WatchAge("solve", conditions::kWorkerStalled, 0.5, [&] { return worker.age_s(); });
  std::promise<void> go_on;
  worker.Post([&]() -> std::function<void()> {
    go_on.get_future().wait();
    return nullptr;
  });
  const health_t stalled =
      RunUntil([](const health_t& m) { return m.state == health_t::STATE_DEGRADED; });
  EXPECT_TRUE(Holds(stalled, conditions::kWorkerStalled)) << stalled.text;
  EXPECT_GT(Counter(stalled, "solve_age_ms"), 500);
  notify.Feedings();
  const std::size_t before = messages.size();
  RunUntil([&](const health_t&) { return messages.size() >= before + 2; });
  EXPECT_GE(notify.Feedings(), 2) << "a computation that takes long is no reason to be killed";
  EXPECT_THAT(notify.last(), HasSubstr("degraded: a computation shows no progress"));
  go_on.set_value();
  worker.Finish();
  RunUntil([](const health_t& m) { return m.state == health_t::STATE_OK; });
}

TEST_F(LiveHealth, AStuckLoopStarvesTheWatchdogAndIsNamedAfterwards) {
  NotifySocket notify;
  Open("memq://");
  health.SetRunning();
  RunUntil([this](const health_t&) { return messages.size() == 3; });
  EXPECT_GE(notify.Feedings(), 1);
  bool stuck = false;
  int fed_meanwhile = -1;
  loop.Every(milliseconds(1), [&] {
    if (stuck) return;
    stuck = true;
    notify.Feedings();
    std::this_thread::sleep_for(milliseconds(2500));
    fed_meanwhile = notify.Feedings();
  });
  const health_t late =
      RunUntil([](const health_t& m) { return m.state == health_t::STATE_DEGRADED; });
  EXPECT_EQ(fed_meanwhile, 0);
  EXPECT_TRUE(Holds(late, conditions::kLoopLate)) << late.text;
  EXPECT_GT(Counter(late, "loop_late_ms"), 2000);
}

TEST_F(LiveHealth, CountsItsRestartsInTheRuntimeDirectory) {
  const TemporaryDir dir;
  dir.Write("starts", "4\n");
  setenv("RUNTIME_DIRECTORY", dir.path().c_str(), 1);
  Open("memq://");
  unsetenv("RUNTIME_DIRECTORY");
  EXPECT_EQ(RunUntil([](const health_t&) { return true; }).restarts, 4);
}

TEST_F(LiveHealth, SaysThatMessagesCannotBeSent) {
  try {
    Open(UdpUrl());
  } catch (const std::exception& e) {
    GTEST_SKIP() << "no multicast here: " << e.what();
  }
  health.SetRunning();
  bus->Publish(std::string(100, 'x'), raw_bytes_t{});  // LCM takes 63 characters
  const health_t msg =
      RunUntil([](const health_t& m) { return m.state == health_t::STATE_DEGRADED; });
  EXPECT_TRUE(Holds(msg, conditions::kMessagesNotSent)) << msg.text;
  EXPECT_EQ(Counter(msg, "bus_publish_errors"), 1);
}

// Drops of our sockets on a port, as the kernel's own table has them. While other processes open
// and close sockets, a row may appear in the table twice: each inode counts once.
std::int64_t DropsInProc(int port) {
  std::ifstream table("/proc/self/net/udp");
  std::string line;
  std::getline(table, line);
  std::map<std::string, std::int64_t> drops_by_inode;
  while (std::getline(table, line)) {
    std::istringstream in(line);
    std::vector<std::string> fields;
    for (std::string field; in >> field;) fields.push_back(field);
    if (fields.size() < 13) continue;
    const std::string& local = fields[1];
    if (std::stoi(local.substr(local.find(':') + 1), nullptr, 16) == port)
      drops_by_inode[fields[9]] = std::stoll(fields[12]);
  }
  std::int64_t drops = 0;
  for (const auto& [inode, count] : drops_by_inode) drops += count;
  return drops;
}

// A burst into the smallest buffer that the kernel gives.
TEST_F(LiveHealth, CountsWhatIsLostInTheSocketOfLcmExactly) {
  const int port = UdpPort();
  const std::string url = UdpUrl();
  std::int64_t received = 0;
  try {
    Open(url + "&recv_buf_size=4096");
    bus->Subscribe<raw_bytes_t>("RAW", 0, [&](const raw_bytes_t&) { ++received; });
  } catch (const std::exception& e) {
    GTEST_SKIP() << "no multicast here: " << e.what();
  }
  health.SetRunning();
  Bus sender(url);
  raw_bytes_t msg{};
  msg.data.resize(1000);
  msg.size = 1000;
  constexpr std::int64_t kSent = 4'000;
  for (std::int64_t i = 0; i < kSent; ++i) sender.Publish("RAW", msg);
  if (sender.publish_errors() > 0) GTEST_SKIP() << "no multicast here: nothing can be sent";
  const health_t lossy =
      RunUntil([](const health_t& m) { return m.state == health_t::STATE_DEGRADED; });
  EXPECT_TRUE(Holds(lossy, conditions::kSocketDrops)) << lossy.text;
  const std::string counter = "socket_drops_udp_" + std::to_string(port);
  const std::size_t before = messages.size();
  const health_t last = RunUntil([&](const health_t&) { return messages.size() == before + 2; });
  const std::int64_t lost = Counter(last, counter);
  EXPECT_GT(lost, 0);
  EXPECT_EQ(received + lost, kSent);
  EXPECT_EQ(lost, DropsInProc(port));
  EXPECT_THAT(last.text, HasSubstr(std::to_string(lost) + " on udp_" + std::to_string(port)));
  EXPECT_LT(Counter(last, "socket_buffer_bytes_udp_" + std::to_string(port)), 10'000);
  RecordProperty("lost", static_cast<int>(lost));
}

int BoundSocket(int family, int* port) {
  const int fd = socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in6 address6{};
  address6.sin6_family = AF_INET6;
  address6.sin6_addr = in6addr_loopback;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool six = family == AF_INET6;
  const auto* any = six ? reinterpret_cast<const sockaddr*>(&address6)
                        : reinterpret_cast<const sockaddr*>(&address);
  socklen_t size = six ? sizeof address6 : sizeof address;
  if (fd < 0 || bind(fd, any, size) != 0) return -1;
  getsockname(fd, reinterpret_cast<sockaddr*>(&address6), &size);
  *port = ntohs(address6.sin6_port);
  const int small = 1;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
  return fd;
}

void Flood(int fd, int datagrams) {
  sockaddr_in6 to{};
  socklen_t size = sizeof to;
  getsockname(fd, reinterpret_cast<sockaddr*>(&to), &size);
  const int sender = socket(to.sin6_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::vector<char> bytes(1000);
  for (int i = 0; i < datagrams; ++i)
    sendto(sender, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), size);
  close(sender);
}

int Waiting(int fd) {
  int waiting = 0;
  char byte = 0;
  while (recv(fd, &byte, 1, MSG_DONTWAIT) >= 0) ++waiting;
  return waiting;
}

TEST(OwnSockets, CountsDropsOfBothFamiliesAndKeepsThoseOfClosedSockets) {
  for (const int family : {AF_INET, AF_INET6}) {
    OwnSockets sockets;
    int port = 0;
    const int fd = BoundSocket(family, &port);
    if (fd < 0) continue;  // a machine without IPv6
    const std::string name = "udp_" + std::to_string(port);
    EXPECT_EQ(sockets.Read().at(name).drops, 0);
    EXPECT_GT(sockets.Read().at(name).buffer_bytes, 0);
    Flood(fd, 500);
    const std::int64_t drops = sockets.Read().at(name).drops;
    EXPECT_EQ(drops, 500 - Waiting(fd));
    EXPECT_GT(drops, 0);
    const int twin = dup(fd);
    EXPECT_EQ(sockets.Read().at(name).drops, drops) << "two descriptors of one socket";
    close(twin);
    close(fd);
    EXPECT_EQ(sockets.Read().at(name).drops, drops);
  }
}

TEST(SelfWatch, ForgetsALossAfterTenSecondsButKeepsItsCount) {
  Bus bus("memq://");
  bus.Subscribe<imu_t>("IMU", 0, [](const imu_t&) {});
  bus.PublishBytes("IMU", "x", 1);
  bus.HandleAll();
  SelfWatch watch;
  EXPECT_EQ(watch.Check(bus, 50.0, 0.0).conditions.size(), 1u);
  EXPECT_EQ(watch.Check(bus, 59.0, 0.0).conditions.size(), 1u);
  const SelfWatch::Report later = watch.Check(bus, 61.0, 0.0);
  EXPECT_TRUE(later.conditions.empty());
  EXPECT_EQ(later.counters.at("undecodable_IMU"), 1);
}

TEST(ThreadWorker, AgeIsThatOfTheLastSignOfLife) {
  ThreadWorker worker(2);
  EXPECT_EQ(worker.age_s(), 0.0);
  std::promise<void> old_enough;
  std::promise<void> reported;
  std::promise<void> go_on;
  worker.Post([&]() -> std::function<void()> {
    old_enough.get_future().wait();
    worker.ReportProgress();
    reported.set_value();
    go_on.get_future().wait();
    return nullptr;
  });
  while (worker.age_s() < 0.2) std::this_thread::sleep_for(milliseconds(1));
  const auto asked = std::chrono::steady_clock::now();
  old_enough.set_value();
  reported.get_future().wait();
  EXPECT_LE(worker.age_s(),
            std::chrono::duration<double>(std::chrono::steady_clock::now() - asked).count());
  go_on.set_value();
  worker.Finish();
  EXPECT_EQ(worker.age_s(), 0.0);
}

}  // namespace
}  // namespace seastitch
