#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "drivers/socket/sender_gate.hpp"

namespace seastitch {

// "SCHEME:ADDRESS[?KEY=VALUE[&KEY=VALUE]]"
struct SourceUrl {
  std::string text;  // the whole
  std::string scheme;
  std::string address;
  std::map<std::string, std::string> options;

  std::string Option(const std::string& key, const std::string& fallback) const {
    const auto found = options.find(key);
    return found == options.end() ? fallback : found->second;
  }
};

// Throws std::runtime_error "TEXT: reason", also for an option that is not among those allowed.
SourceUrl ParseSourceUrl(const std::string& text, const std::set<std::string>& allowed_options);

// Of udp:HOST:PORT or tcp:HOST:PORT. Throws std::runtime_error "TEXT: reason".
struct HostPort {
  std::string host;
  std::uint16_t port = 0;
};
HostPort HostPortOf(const SourceUrl& url);

// Of candump:FILE?speed=X, 1 where it names none. Throws std::runtime_error "TEXT: reason".
double SpeedOf(const SourceUrl& url);

// Of udp:HOST:PORT?from=10.0.0.5,10.0.0.6: who may send. Throws std::runtime_error "TEXT: reason".
SenderGate GateOf(const SourceUrl& url);

// Of serial:DEVICE?baud=X, 4800 where it names none (as NMEA 0183 has it). Throws
// std::runtime_error "TEXT: reason" for a rate that there is not.
int BaudOf(const SourceUrl& url);

// Kinds of sources that a driver can read.
enum class SourceKind : std::uint8_t { kCan, kDatagrams, kStream, kBytes };

// Throws std::runtime_error "TEXT: reason" if the URL is invalid or of another kind. Devices and
// interfaces need not exist.
void ExpectUsable(const std::string& text, SourceKind kind);

}  // namespace seastitch
