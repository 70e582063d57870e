#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/storage/event_log.hpp"
#include "survey/errors.hpp"

namespace seastitch {

// Watches the type fingerprints of a log's events on the channels of Seastitch. An unreadable
// version of a type, or a foreign type on a channel of the same name, has another fingerprint.
class MessageTypes {
 public:
  // True if the event has the type of its channel; false also for an unknown channel.
  bool Add(const LogEvent& event);

  // Number of events of another type, by channel.
  std::map<std::string, std::int64_t> Foreign() const;
  // A channel without any event of the channel's type.
  struct Unreadable {
    const Channel* channel;
    std::optional<std::int64_t> fingerprint;  // of its first event; nothing if that is too short
  };
  // In the order of the table.
  std::vector<Unreadable> UnreadableChannels() const;

 private:
  struct Count {
    std::int64_t known = 0;
    std::int64_t foreign = 0;
    std::optional<std::int64_t> first_foreign;
  };
  std::map<const Channel*, Count> counts_;
};

// Throws DataError if a channel of this role is unreadable.
void ExpectReadable(const MessageTypes& types, ChannelRole role);
// One line: channel, fingerprint, type expected.
std::string ToString(const MessageTypes::Unreadable& unreadable);
// As 16 hexadecimal digits; "none" where there is none.
std::string FingerprintText(const std::optional<std::int64_t>& fingerprint);

}  // namespace seastitch
