#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/core/bytes.hpp"
#include "common/core/channel_names.hpp"
#include "common/core/sample.hpp"

namespace seastitch {

// Bytes from a device, as a driver records them. A view.
struct RawBytes {
  const std::string& channel;  // such as channels::kRawCan
  const std::string& source;   // the driver's `source`
  Time recv;
  Bytes bytes;
};

// Samples and raw bytes as messages, numbered by channel. Send is called with a channel and a
// message, once for each message that a sample needs.
class MessageOutbox {
 public:
  template <class Send>
  void Put(const Sample& sample, Time recv, const Send& send) {
    std::visit([&](const auto& s) { PutOne(s, recv, send); }, sample);
  }
  template <class Send>
  void Put(const RawBytes& raw, const Send& send) {
    std::int64_t& seq = seqs_[raw.channel];
    for (const raw_bytes_t& part : ToRawParts(raw.bytes, raw.source, raw.recv, seq)) {
      send(raw.channel, part);
      ++seq;
    }
  }

 private:
  static const char* ChannelOf(const ImuSample&) { return channels::kImu; }
  static const char* ChannelOf(const DvlSample&) { return channels::kDvl; }
  static const char* ChannelOf(const DepthSample&) { return channels::kDepth; }
  static const char* ChannelOf(const NavigationSample&) { return channels::kIns; }
  static const char* ChannelOf(const PositionFix&) { return channels::kPositionFix; }
  static const char* ChannelOf(const MbesPing&) { return channels::kMbesPing; }
  static const char* ChannelOf(const SoundingPing&) { return channels::kMbesSoundings; }
  static const char* ChannelOf(const SoundVelocityProfile&) { return channels::kSvp; }

  template <class T, class Send>
  void PutOne(const T& sample, Time recv, const Send& send) {
    const char* const channel = ChannelOf(sample);
    send(channel, ToLcm(sample, MessageStamp{recv, seqs_[channel]++}));
  }
  template <class Send>
  void PutOne(const SoundingPing& ping, Time recv, const Send& send) {
    std::int64_t& seq = seqs_[channels::kMbesSoundings];
    for (const mbes_soundings_t& part : ToLcm(ping, MessageStamp{recv, seq})) {
      send(channels::kMbesSoundings, part);
      ++seq;
    }
  }
  // Processes send it themselves: see Health.
  template <class Send>
  void PutOne(const Heartbeat&, Time, const Send&) {}

  std::map<std::string, std::int64_t> seqs_;  // of the next message, by channel
};

}  // namespace seastitch
