#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/channel_names.hpp"

// The one table of LCM channels: logger, info, replay, mapper and optimizer read it, and the table
// of docs/channels.md is made from it.
namespace seastitch {

enum class ChannelRole : std::uint8_t {
  kSensor,   // what a map is made from
  kResult,   // what mapper and optimizer make
  kRaw,      // the bytes of a device before decoding
  kHealth,   // what processes report of themselves
  kRequest,  // a request, or the answer to one
};
const char* ToString(ChannelRole role);

// Where a type keeps time and number: in 64-bit words behind the fingerprint.
struct MessageLayout {
  int utime = 0;  // -1: it has none
  int recv_utime = -1;
  int seq = 1;
  bool has_sender = false;  // several processes send, and a name behind `seq` tells them apart
};

struct Channel {
  const char* name;
  const char* type;          // such as "imu_t", of package seastitch
  std::int64_t fingerprint;  // LCM's hash of the type: the first 8 bytes of a message
  MessageLayout layout;
  ChannelRole role;
  int queue;  // messages that LCM keeps for a subscriber of ours; 0: no limit
  const char* sender;
  const char* receiver;  // nothing: "anyone"
  const char* rate;
  const char* content;
  bool (*decodes)(Bytes message);  // a whole message of the type
};

// In the order of the documentation.
const std::vector<Channel>& Channels();
// Null for a name that is not in the table.
const Channel* FindChannel(std::string_view name);
// The queue of a channel of the table. Throws std::out_of_range for any other name.
int QueueOf(std::string_view name);
// A channel of the type, null where the type is none of ours. Types tell messages apart where
// somebody gave their channel another name.
const Channel* ChannelOfType(std::int64_t fingerprint);

// The first 8 bytes of a message; nothing where it has fewer.
std::optional<std::int64_t> FingerprintOf(Bytes message);

// What a message says of its place in the channel.
struct MessagePlace {
  std::int64_t seq = 0;  // not below 0
  std::optional<std::int64_t> utime;
  std::optional<std::int64_t> recv_utime;
  std::string sender;  // whose `seq` it is; empty where the channel has one sender
};
// Read from the bytes, by their fingerprint, without decoding the rest. Nothing where the type is
// none of ours, the message is too short or its number is below 0.
std::optional<MessagePlace> PlaceOf(Bytes message);

}  // namespace seastitch
