#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Which IPv4 address may send to a driver: those configured, else the first whose datagrams the
// codec understood, until none of them comes for 5 s. Until one is understood everybody may, so
// that strangers do not keep the device out. Addresses are in host order. Knows only the stamps
// that it is given.
class SenderGate {
 public:
  // The first that is understood.
  SenderGate() = default;
  // allowed: "10.0.0.5,10.0.0.6". Throws std::runtime_error "'TEXT': ..." for what is no IPv4
  // address.
  explicit SenderGate(const std::string& allowed);

  bool Accepts(std::uint32_t address, Time recv);
  // The codec made sense of a datagram of this sender, which Accepts() let pass.
  void Understood(std::uint32_t address, Time recv);
  // Of the last that was refused, for people: "10.0.0.9, while 10.0.0.5 sends"; empty: none was.
  std::string refusal() const;

 private:
  static constexpr std::uint32_t kNobody = 0;  // 0.0.0.0 sends nothing
  bool IsItsTurn(std::uint32_t address, Time recv) const;

  std::set<std::uint32_t> allowed_;
  std::uint32_t understood_ = kNobody;
  Time understood_at_;
  std::uint32_t refused_ = kNobody;  // last
};

}  // namespace seastitch
