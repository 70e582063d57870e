#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Datagrams of senders that a driver does not accept.
struct SenderRefusal {
  std::int64_t count = 0;
  std::string last;  // for people: "10.0.0.9, while 10.0.0.5 sends"; empty if there was none
};

// Decides from which IPv4 addresses a driver accepts datagrams. With configured addresses: from all
// of these. Else from one address: the first whose datagram the codec decoded, until 5 s pass
// without a decoded datagram from it. Before the first decoded datagram all addresses are accepted,
// so that another sender that comes first does not lock the device out. Addresses are in host byte
// order. It reads no clock.
class SenderGate {
 public:
  // Without configured addresses.
  SenderGate() = default;
  // allowed: "10.0.0.5,10.0.0.6". Throws std::runtime_error "'TEXT': ..." if an item is
  // not an IPv4 address.
  explicit SenderGate(const std::string& allowed);

  bool Accepts(std::uint32_t address, Time recv);
  // Call it when the codec decoded a datagram that Accepts() let pass.
  void Understood(std::uint32_t address, Time recv);
  // The number of datagrams that were not accepted, and the last address of them.
  SenderRefusal refusal() const;

 private:
  static constexpr std::uint32_t kNobody = 0;  // 0.0.0.0, which is never the address of a sender
  bool IsItsTurn(std::uint32_t address, Time recv) const;

  std::set<std::uint32_t> allowed_;
  std::uint32_t understood_ = kNobody;
  Time understood_at_;
  std::uint32_t refused_ = kNobody;  // last
  std::int64_t refusals_ = 0;
};

}  // namespace seastitch
