#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/counters.hpp"
#include "common/core/time.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/sender_gate.hpp"
#include "drivers/socket/source_url.hpp"

namespace seastitch {

struct Datagram {
  std::vector<std::uint8_t> bytes;
  Time recv;                 // the kernel's stamp
  std::uint64_t sender = 0;  // IPv4 address and port, to tell senders apart
};

// Receives IPv4 datagrams. A host of 224.0.0.0/4 is a multicast group and is joined; its port may
// be shared with other receivers. Any other host is the local address to listen on (0.0.0.0: all).
class UdpSocket {
 public:
  // "udp:HOST:PORT[?interface=eth1][&from=10.0.0.5,10.0.0.6]", the interface (name) on which to
  // join, and who may send (SenderGate). Throws
  // std::runtime_error "URL: reason" where that is not an address. A port that is taken, or an
  // interface that is missing, is waited for.
  UdpSocket(const std::string& url, int receive_buffer_bytes);
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return socket_.fd(); }
  // Takes one datagram; false when none waits. Truncated ones, and those of other senders, are
  // counted, never given.
  bool Receive(Datagram* datagram);
  // Call it for a datagram that turned out to be the device's: see SenderGate.
  void Understood(const Datagram& datagram);
  // An interface that was pulled and put back has forgotten the group: joins it again. Call it
  // regularly.
  void CheckInterface();
  // Why nothing can come, for people; empty while it listens.
  const std::string& trouble() const { return socket_.trouble(); }

  // Of the last datagram of another sender: see SenderGate.
  std::string refusal() const { return gate_.refusal(); }

  // udp_interface_gone, udp_refused_senders (datagrams), udp_dropped (receive buffer full),
  // udp_truncated, udp_receive_errors, udp_unstamped (by the kernel), udp_receive_buffer_bytes
  // (granted).
  const Counters& counters() const { return counters_; }

 private:
  FileDescriptor Open();

  SourceUrl url_;
  sockaddr_in address_;
  SenderGate gate_;
  int wanted_buffer_bytes_;
  unsigned joined_index_ = 0;  // of the interface that the URL names
  std::uint32_t kernel_drops_ = 0;
  std::vector<std::uint8_t> buffer_;
  Counters counters_;
  PatientSocket socket_;
};

}  // namespace seastitch
