#include "drivers/socket/sender_gate.hpp"

#include <arpa/inet.h>

#include <chrono>
#include <sstream>
#include <stdexcept>

namespace seastitch {
namespace {

constexpr Duration kSilence = std::chrono::seconds(5);

std::uint32_t AddressOf(const std::string& text) {
  in_addr address{};
  if (inet_pton(AF_INET, text.c_str(), &address) != 1)
    throw std::runtime_error("'" + text + "': expected IPv4 addresses, such as 10.0.0.5,10.0.0.6");
  return ntohl(address.s_addr);
}

std::string TextOf(std::uint32_t address) {
  const in_addr binary{htonl(address)};
  char text[INET_ADDRSTRLEN] = {};
  return inet_ntop(AF_INET, &binary, text, sizeof text);
}

}  // namespace

SenderGate::SenderGate(const std::string& allowed) {
  std::istringstream texts(allowed + ",");  // the comma makes an empty last entry visible
  for (std::string text; std::getline(texts, text, ',');) allowed_.insert(AddressOf(text));
}

bool SenderGate::Accepts(std::uint32_t address, Time recv) {
  if (allowed_.empty() ? IsItsTurn(address, recv) : allowed_.contains(address)) return true;
  refused_ = address;
  ++refusals_;
  return false;
}

SenderRefusal SenderGate::refusal() const {
  if (refused_ == kNobody) return {refusals_, ""};
  return {refusals_,
          TextOf(refused_) + (allowed_.empty() ? ", while " + TextOf(understood_) + " sends"
                                               : ", which is not named")};
}

bool SenderGate::IsItsTurn(std::uint32_t address, Time recv) const {
  // abs(): after a step back of the clock the sender must not be refused.
  const bool silent = std::chrono::abs(recv - understood_at_) >= kSilence;
  return understood_ == kNobody || understood_ == address || silent;
}

void SenderGate::Understood(std::uint32_t address, Time recv) {
  if (understood_ != address) refused_ = kNobody;
  understood_ = address;
  understood_at_ = recv;
}

}  // namespace seastitch
