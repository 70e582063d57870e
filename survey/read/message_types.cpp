#include "survey/read/message_types.hpp"

#include <cinttypes>
#include <cstdio>

namespace seastitch {

bool MessageTypes::Add(const LogEvent& event) {
  const Channel* channel = FindChannel(event.channel);
  if (channel == nullptr) return false;
  Count& count = counts_[channel];
  const std::optional<std::int64_t> fingerprint = FingerprintOf(event.data);
  if (fingerprint == channel->fingerprint) {
    ++count.known;
    return true;
  }
  if (++count.foreign == 1) count.first_foreign = fingerprint;
  return false;
}

std::map<std::string, std::int64_t> MessageTypes::Foreign() const {
  std::map<std::string, std::int64_t> foreign;
  for (const auto& [channel, count] : counts_)
    if (count.foreign > 0) foreign[channel->name] = count.foreign;
  return foreign;
}

std::vector<MessageTypes::Unreadable> MessageTypes::UnreadableChannels() const {
  std::vector<Unreadable> unreadable;
  for (const Channel& channel : Channels()) {
    const auto found = counts_.find(&channel);
    if (found != counts_.end() && found->second.known == 0)
      unreadable.push_back({&channel, found->second.first_foreign});
  }
  return unreadable;
}

void ExpectReadable(const MessageTypes& types, ChannelRole role) {
  for (const MessageTypes::Unreadable& unreadable : types.UnreadableChannels())
    if (unreadable.channel->role == role) throw DataError(ToString(unreadable));
}

std::string FingerprintText(const std::optional<std::int64_t>& fingerprint) {
  if (!fingerprint) return "none";
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, static_cast<std::uint64_t>(*fingerprint));
  return text;
}

std::string ToString(const MessageTypes::Unreadable& unreadable) {
  const Channel& channel = *unreadable.channel;
  return std::string(channel.name) + ": fingerprint " + FingerprintText(unreadable.fingerprint) +
         ", expected " + channel.type + " (" + FingerprintText(channel.fingerprint) + ")";
}

}  // namespace seastitch
