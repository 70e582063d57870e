#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/channel_names.hpp"

// Table of all LCM channels. Logger, info, replay, mapper and optimizer use it; docs/channels.md is
// generated from it.
namespace seastitch {

enum class ChannelRole : std::uint8_t {
  kSensor,   // measurements
  kResult,   // results of mapper and optimizer
  kRaw,      // the bytes of a device before decoding
  kHealth,   // state of processes
  kRequest,  // a request, or the answer to one
};
const char* ToString(ChannelRole role);

// Positions of time and sequence number in a type, in 64-bit words after the fingerprint.
struct MessageLayout {
  int utime = 0;  // -1: it has none
  int recv_utime = -1;
  int seq = 1;
  bool has_sender = false;  // several processes send; the name after `seq` distinguishes them
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
// A channel with that type; null where the type is not in the table. For messages on channels with
// other names.
const Channel* ChannelOfType(std::int64_t fingerprint);

// The first 8 bytes of a message; absent where it has fewer.
std::optional<std::int64_t> FingerprintOf(Bytes message);

// Time, sequence number and sender of a message.
struct MessagePlace {
  std::int64_t seq = 0;  // not below 0
  std::optional<std::int64_t> utime;
  std::optional<std::int64_t> recv_utime;
  std::string sender;  // whose `seq` it is; empty where the channel has one sender
};
// Reads them from the bytes, by their fingerprint, without decoding the rest. Absent where the type
// is not in the table, the message is too short or its number is below 0.
std::optional<MessagePlace> PlaceOf(Bytes message);
// So many bytes from the beginning of a message hold its type and its place.
inline constexpr std::size_t kBytesOfPlace = 512;

}  // namespace seastitch
