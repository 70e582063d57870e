#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace seastitch {

// An LCM bus, selected by its URL: udpm://... on the vehicle, or memq:// inside one process, for
// replay and tests (first in, first out, without sockets and threads).
class Bus {
 public:
  // An empty URL means LCM_DEFAULT_URL, or LCM's own default. A udpm URL without recv_buf_size gets
  // the largest that net.core.rmem_max grants, up to 8 MiB. Throws std::runtime_error
  // "cannot open LCM bus URL: reason".
  explicit Bus(const std::string& url);

  // Descriptor that is readable when a message waits. Throws std::runtime_error where the bus
  // cannot receive, such as without a multicast route.
  int fd();
  // Handles one message; blocks until there is one. Negative: the bus has failed.
  int HandleReady() { return lcm_.handle(); }
  // Handles all waiting messages, and with memq also those published meanwhile. A live process
  // bounds the number, so that a flood does not delay its timers and signals. Throws
  // std::runtime_error where the bus has failed or ended, such as at the end of a file:// log.
  void HandleAll(int at_most = std::numeric_limits<int>::max());
  static constexpr int kBurst = 256;
  // Handles messages that other processes sent before they stopped and that are still in the
  // socket: until none came for 50 ms, at most for 1 s.
  void HandleUntilQuiet();

  template <class Msg>
  void Publish(const std::string& channel, const Msg& msg) {
    if (lcm_.publish(channel, &msg) != 0) ++publish_errors_;
  }
  void PublishBytes(const std::string& channel, const void* data, std::size_t size);

  // Calls fn for each message that can be decoded; others are counted. queue: largest number of
  // messages that LCM keeps until they are handled; LCM drops further ones, which shows as a gap in
  // seq. 0: no limit.
  template <class Msg>
  void Subscribe(const std::string& channel, int queue, std::function<void(const Msg&)> fn) {
    SubscribeBytes(channel,
                   queue,
                   [fn = std::move(fn), undecodable = &undecodable_[channel]](
                       const std::string&, const void* data, int size) {
                     Msg msg{};  // braces: generated types do not zero themselves
                     if (msg.decode(data, 0, size) != size) {
                       ++*undecodable;
                       return;
                     }
                     fn(msg);
                   });
  }
  // channel_regex is an LCM channel pattern, such as ".*", that IsPattern().
  using BytesHandler = std::function<void(const std::string& channel, const void* data, int size)>;
  void SubscribeBytes(const std::string& channel_regex, int queue, BytesHandler fn);
  // The same with LCM's receive time (system clock, microseconds), for recording the bus.
  using EventHandler =
      std::function<void(const std::string& channel, const lcm::ReceiveBuffer& buffer)>;
  void SubscribeEvents(const std::string& channel_regex, int queue, EventHandler fn);

  // True if LCM accepts it as a channel pattern: a Perl regular expression for the whole name.
  static bool IsPattern(const std::string& channel_regex);

  // Numbers of messages that could not be decoded: by subscribed channel, and in total.
  const std::map<std::string, std::int64_t>& undecodable() const { return undecodable_; }
  std::int64_t decode_errors() const;
  std::int64_t publish_errors() const { return publish_errors_; }

 private:
  struct Slot {
    EventHandler on_event;
    void On(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
      on_event(channel, *buffer);
    }
  };

  const std::string url_;
  lcm::LCM lcm_;
  std::list<Slot> slots_;  // stable addresses for LCM
  std::int64_t publish_errors_ = 0;
  std::map<std::string, std::int64_t> undecodable_;  // stable addresses for the handlers
};

}  // namespace seastitch
