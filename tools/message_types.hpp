#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {

// An input that cannot be used for what it holds: exit code 65.
struct DataError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A command line that asks for what cannot be done: exit code 64.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Watches the type fingerprints of a log's events on the channels of Seastitch. An unreadable
// version of a type, or a foreign type on a channel of the same name, has another fingerprint.
class MessageTypes {
 public:
  // Whether the event has the type of its channel. False where the channel is none of ours.
  bool Add(const LogEvent& event);

  // Events that have not, by channel.
  std::map<std::string, std::int64_t> Foreign() const;
  // A channel no event of which has the type of the channel.
  struct Unreadable {
    const Channel* channel;
    std::optional<std::int64_t> fingerprint;  // of its first event; nothing: too short for one
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

// Throws DataError where there is one of this role.
void ExpectReadable(const MessageTypes& types, ChannelRole role);
// One line: channel, fingerprint, type expected.
std::string ToString(const MessageTypes::Unreadable& unreadable);
// As 16 hexadecimal digits; "none" where there is none.
std::string FingerprintText(const std::optional<std::int64_t>& fingerprint);

}  // namespace seastitch
