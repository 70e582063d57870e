#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <limits>
#include <list>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace seastitch {

// The LCM bus. The URL decides which: udpm://... on the vehicle, memq:// inside one process (in
// replay and tests: first in, first out, no socket, no thread).
class Bus {
 public:
  // An empty URL means LCM_DEFAULT_URL, or LCM's own default. A udpm URL without recv_buf_size gets
  // the largest that net.core.rmem_max grants, up to 8 MiB. Throws std::runtime_error
  // "cannot open LCM bus URL: reason".
  explicit Bus(const std::string& url);

  // Becomes readable when HandleReady() has something to do. Throws std::runtime_error where the
  // bus cannot receive, such as without a multicast route.
  int fd();
  // Handles one waiting message; waits for it where there is none. Negative: the bus is dead.
  int HandleReady() { return lcm_.handle(); }
  // Handles every message that waits now and every message published meanwhile (memq). A live
  // process bounds it, so that a flood does not keep its timers and signals waiting. Throws
  // std::runtime_error where the bus is dead, such as at the end of a file://: nothing will come.
  void HandleAll(int at_most = std::numeric_limits<int>::max());
  static constexpr int kBurst = 256;
  // Handles what others sent before they stopped and is still on its way through the socket: until
  // nothing came for 50 ms, or for a second.
  void HandleUntilQuiet();

  template <class Msg>
  void Publish(const std::string& channel, const Msg& msg) {
    if (lcm_.publish(channel, &msg) != 0) ++publish_errors_;
  }
  void PublishBytes(const std::string& channel, const void* data, std::size_t size);

  // Calls fn for each message that decodes whole; others are counted, never delivered. `queue` is
  // the number of undelivered messages that LCM keeps; more are dropped by LCM and seen as a gap
  // in seq. 0: no limit.
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
  // The same with LCM's receive stamp (system clock, microseconds), for records of the bus.
  using EventHandler =
      std::function<void(const std::string& channel, const lcm::ReceiveBuffer& buffer)>;
  void SubscribeEvents(const std::string& channel_regex, int queue, EventHandler fn);

  // Whether LCM can read it as a channel pattern (a Perl regular expression).
  static bool IsPattern(const std::string& channel_regex);

  // Messages that did not decode whole, by the channel subscribed; and all of them.
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

// Watches the sequence numbers of one channel. Add() gives how many were lost before this message.
class SequenceWatch {
 public:
  std::int64_t Add(std::int64_t seq) {
    // A restart of the sender begins again at 0: not a loss.
    if (seq < 0 || seq == std::numeric_limits<std::int64_t>::max()) return 0;  // damaged
    const std::int64_t lost = next_ < 0 || seq < next_ ? 0 : seq - next_;
    next_ = seq + 1;
    return lost;
  }

 private:
  std::int64_t next_ = -1;
};

}  // namespace seastitch
