#include "common/convert/message_inbox.hpp"

#include <utility>

#include "common/core/channel_names.hpp"

namespace seastitch {
namespace {

// A message without a receive stamp counts as received when it was measured.
template <class Msg>
Time ReceivedAt(const Msg& msg) {
  return FromUtime(msg.recv_utime > 0 ? msg.recv_utime : msg.utime);
}

}  // namespace

template <class Msg>
std::optional<Received> MessageInbox::TakeOne(const Msg& msg, bool has_one_sender, double now_s) {
  using T = typename decltype(FromLcm(msg))::value_type;
  const char* const name = NameOf(T{});
  Stream& stream = streams_[name];
  const bool is_first = stream.sender.Add({ReceivedAt(msg), msg.seq});
  if (has_one_sender && !is_first) {
    stream.others.Add(now_s);
    return std::nullopt;
  }
  stream.lost += stream.sequence.Add(msg.seq);
  if (auto sample = FromLcm(msg))
    return Received{*std::move(sample), {FromUtime(msg.recv_utime), msg.seq}};
  CountMalformed(name, now_s);
  return std::nullopt;
}

std::optional<Received> MessageInbox::Take(const imu_t& msg, double now_s) {
  return TakeOne(msg, true, now_s);
}
std::optional<Received> MessageInbox::Take(const dvl_t& msg, double now_s) {
  return TakeOne(msg, true, now_s);
}
std::optional<Received> MessageInbox::Take(const navigation_t& msg, double now_s) {
  return TakeOne(msg, true, now_s);
}
std::optional<Received> MessageInbox::Take(const mbes_ping_t& msg, double now_s) {
  return TakeOne(msg, true, now_s);
}
// Depths may come from two devices, fixes from GPS and USBL.
std::optional<Received> MessageInbox::Take(const depth_t& msg, double now_s) {
  return TakeOne(msg, false, now_s);
}
std::optional<Received> MessageInbox::Take(const position_fix_t& msg, double now_s) {
  return TakeOne(msg, false, now_s);
}
std::optional<Received> MessageInbox::Take(const mbes_soundings_t& msg, double now_s) {
  return TakeOne(msg, false, now_s);
}
std::optional<Received> MessageInbox::Take(const sound_velocity_profile_t& msg, double now_s) {
  return TakeOne(msg, false, now_s);
}
// Every process sends it, each with its own numbers.
std::optional<Received> MessageInbox::Take(const health_t& msg, double) {
  if (auto heartbeat = FromLcm(msg)) return Received{*std::move(heartbeat), {}};
  return std::nullopt;
}

template <class Msg>
std::optional<Received> MessageInbox::Decode(Bytes message, double now_s) {
  Msg msg{};  // braces: generated types do not zero themselves
  const auto size = static_cast<int>(message.size());
  if (msg.decode(message.data(), 0, size) != size) return std::nullopt;
  return Take(msg, now_s);
}

std::optional<Received> MessageInbox::Take(std::string_view channel, Bytes message, double now_s) {
  if (channel == channels::kImu) return Decode<imu_t>(message, now_s);
  if (channel == channels::kDvl) return Decode<dvl_t>(message, now_s);
  if (channel == channels::kDepth) return Decode<depth_t>(message, now_s);
  if (channel == channels::kIns) return Decode<navigation_t>(message, now_s);
  if (channel == channels::kPositionFix) return Decode<position_fix_t>(message, now_s);
  if (channel == channels::kMbesPing) return Decode<mbes_ping_t>(message, now_s);
  if (channel == channels::kMbesSoundings) return Decode<mbes_soundings_t>(message, now_s);
  if (channel == channels::kSvp) return Decode<sound_velocity_profile_t>(message, now_s);
  if (channel == channels::kHealth) return Decode<health_t>(message, now_s);
  return std::nullopt;
}

void MessageInbox::CountMalformed(const std::string& name, double now_s) {
  streams_[name].malformed.Add(now_s);
}

std::int64_t MessageInbox::lost() const {
  std::int64_t all = 0;
  for (const auto& [name, stream] : streams_) all += stream.lost;
  return all;
}

Counters MessageInbox::counters() const {
  Counters counters;
  for (const auto& [name, stream] : streams_) {
    counters[name + "_lost"] = stream.lost;
    counters[name + "_malformed"] = stream.malformed.total();
    counters[name + "_of_another_sender"] = stream.others.total();
  }
  std::erase_if(counters, [](const auto& counter) { return counter.second == 0; });
  return counters;
}

std::vector<Condition> MessageInbox::Faults(double now_s) const {
  std::vector<Condition> faults;
  for (const auto& [name, stream] : streams_)
    if (stream.others.Holds(now_s)) faults.push_back({&conditions::kTwoSenders, name});
  for (const auto& [name, stream] : streams_)
    if (stream.malformed.Holds(now_s))
      faults.push_back({&conditions::kMessagesMalformed,
                        std::to_string(stream.malformed.total()) + " of " + name});
  return faults;
}

}  // namespace seastitch
