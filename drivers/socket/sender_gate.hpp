#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Which IPv4 address may speak to a driver: those configured, else the first that was heard until
// it is silent for 5 s. Addresses are in host order. Knows only the stamps that it is given.
class SenderGate {
 public:
  // The first that is heard.
  SenderGate() = default;
  // allowed: "10.0.0.5,10.0.0.6". Throws std::runtime_error "'TEXT': ..." for what is no IPv4
  // address.
  explicit SenderGate(const std::string& allowed);

  bool Accepts(std::uint32_t address, Time recv);
  // Of the last that was refused, for people: "10.0.0.9, while 10.0.0.5 sends"; empty: none was.
  std::string refusal() const;

 private:
  static constexpr std::uint32_t kNobody = 0;  // 0.0.0.0 sends nothing
  bool IsItsTurn(std::uint32_t address, Time recv);

  std::set<std::uint32_t> allowed_;
  std::uint32_t heard_ = kNobody;
  Time heard_at_;
  std::uint32_t refused_ = kNobody;  // last
};

}  // namespace seastitch
