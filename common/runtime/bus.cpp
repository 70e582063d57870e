#include "common/runtime/bus.hpp"

#include <arpa/inet.h>
#include <glib.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace seastitch {
namespace {

constexpr char kLcmDefaultUrl[] = "udpm://239.255.76.67:7667?ttl=0";
constexpr long kWantedReceiveBuffer = 8L << 20;
// Below this size the socket loses messages in the bursts of the vehicle's own traffic.
constexpr long kModestReceiveBuffer = 2L << 20;

std::string Resolved(const std::string& url) {
  if (!url.empty()) return url;
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  return from_environment != nullptr && *from_environment != '\0' ? from_environment
                                                                  : kLcmDefaultUrl;
}

// rmem_max [bytes]; 0 if the kernel does not state it.
long LargestReceiveBuffer() {
  long bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> bytes;
  return bytes;
}

// The URL with a receive buffer. Without one, LCM uses rmem_default: room for three datagrams of 64
// kB.
std::string WithReceiveBuffer(const std::string& url) {
  const bool ours_to_choose =
      url.starts_with("udpm://") && url.find("recv_buf_size") == std::string::npos;
  const long granted = std::min(kWantedReceiveBuffer, LargestReceiveBuffer());
  if (!ours_to_choose || granted <= 0) return url;
  if (granted < kModestReceiveBuffer)
    spdlog::warn(
        "LCM receive buffer is {} bytes: raise net.core.rmem_max to {} or bursts will be lost",
        granted,
        kWantedReceiveBuffer);
  const char separator = url.find('?') == std::string::npos ? '?' : '&';
  return url + separator + "recv_buf_size=" + std::to_string(granted);
}

std::runtime_error CannotOpen(const std::string& url, const std::string& reason) {
  return std::runtime_error("cannot open LCM bus " + url + ": " + reason);
}

// The way to a bus within one computer.
constexpr char kRouteCommands[] =
    "for this computer alone: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo";

std::runtime_error CannotReceive(const std::string& url) {
  return CannotOpen(
      url, std::string("it does not receive. Is there a multicast route? ") + kRouteCommands);
}

// The same URL. Throws where the kernel has no route to its multicast address, which LCM itself
// reports in words of its own.
std::string WithRoute(const std::string& url) {
  constexpr std::string_view kScheme = "udpm://";
  if (!url.starts_with(kScheme)) return url;
  const std::string host =
      url.substr(kScheme.size(), url.find(':', kScheme.size()) - kScheme.size());
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(7667);
  if (inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) return url;
  const int probe = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return url;
  const int connected = ::connect(probe, reinterpret_cast<sockaddr*>(&address), sizeof address);
  const int error = errno;
  ::close(probe);
  if (connected != 0 && error == ENETUNREACH)
    throw CannotOpen(url, "no route to " + host + "; " + kRouteCommands);
  return url;
}

}  // namespace

Bus::Bus(const std::string& url) : url_(WithRoute(Resolved(url))), lcm_(WithReceiveBuffer(url_)) {
  if (!lcm_.good())
    throw CannotOpen(url_,
                     "not an address that LCM can open, such as udpm://239.255.76.67:7667?ttl=0");
}

int Bus::fd() {
  const int descriptor = lcm_.getFileno();
  if (descriptor < 0) throw CannotReceive(url_);
  return descriptor;
}

void Bus::HandleAll(int at_most) {
  for (int handled = 0; handled < at_most; ++handled) {
    const int result = lcm_.handleTimeout(0);
    if (result < 0)
      throw std::runtime_error("LCM bus " + url_ + ": nothing comes from it any more");
    if (result == 0) return;
  }
}

void Bus::HandleUntilQuiet() {
  constexpr int kQuiet_ms = 50;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  while (std::chrono::steady_clock::now() < deadline && lcm_.handleTimeout(kQuiet_ms) > 0) {
  }
}

bool Bus::IsPattern(const std::string& channel_regex) {
  // Compiles the pattern as LCM does: LCM's C++ interface does not return the error.
  GRegex* regex = g_regex_new(
      ("^" + channel_regex + "$").c_str(), GRegexCompileFlags{}, GRegexMatchFlags{}, nullptr);
  if (regex == nullptr) return false;
  g_regex_unref(regex);
  return true;
}

std::int64_t Bus::decode_errors() const {
  std::int64_t sum = 0;
  for (const auto& [channel, count] : undecodable_) sum += count;
  return sum;
}

void Bus::PublishBytes(const std::string& channel, const void* data, std::size_t size) {
  if (lcm_.publish(channel, data, static_cast<unsigned>(size)) != 0) ++publish_errors_;
}

void Bus::SubscribeBytes(const std::string& channel_regex, int queue, BytesHandler fn) {
  SubscribeEvents(
      channel_regex,
      queue,
      [fn = std::move(fn)](const std::string& channel, const lcm::ReceiveBuffer& buffer) {
        fn(channel, buffer.data, static_cast<int>(buffer.data_size));
      });
}

void Bus::SubscribeEvents(const std::string& channel_regex, int queue, EventHandler fn) {
  Slot& slot = slots_.emplace_back(Slot{std::move(fn)});
  lcm::Subscription* subscription = lcm_.subscribe(channel_regex, &Slot::On, &slot);
  if (subscription == nullptr) throw CannotReceive(url_);
  subscription->setQueueCapacity(queue);
}

}  // namespace seastitch
