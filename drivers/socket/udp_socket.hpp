#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "common/core/time.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/sender_gate.hpp"
#include "drivers/socket/source_url.hpp"

namespace seastitch {

struct Datagram {
  std::vector<std::uint8_t> bytes;
  Time recv;                 // the kernel's receive stamp
  std::uint64_t sender = 0;  // IPv4 address << 16 | port
};

// Receives IPv4 datagrams. HOST of the URL is the local address to listen on (0.0.0.0: all), or a
// multicast group (224.0.0.0/4), which the socket joins. Other processes of this computer may
// receive the same group and port.
class UdpSocket {
 public:
  // url: "udp:HOST:PORT[?interface=eth1][&from=10.0.0.5,10.0.0.6]". interface: on which to join the
  // group. from: accepted senders (SenderGate). Throws std::runtime_error "URL: reason" if the URL
  // is invalid. If another process holds the port, or the interface is missing, the socket retries
  // every second.
  UdpSocket(const std::string& url, int receive_buffer_bytes);
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return socket_.fd(); }
  // Takes one datagram from the queue; false if it is empty. Truncated datagrams, and those of
  // senders that are not accepted, are counted and not returned.
  bool Receive(Datagram* datagram);
  // Call it for a datagram that was decoded: see SenderGate.
  void Understood(const Datagram& datagram);
  // Joins the multicast group again if the interface was removed and added. Call it once a second.
  void CheckInterface();
  // Why it cannot receive, for people; empty while it listens.
  const std::string& trouble() const { return socket_.trouble(); }

  // The last sender that was not accepted: see SenderGate.
  SenderRefusal refusal() const { return gate_.refusal(); }

  // udp_interface_gone, udp_refused_senders (datagrams), udp_dropped (receive buffer full),
  // udp_truncated, udp_receive_errors, udp_unstamped (without the kernel's stamp: the time of the
  // read call is used), udp_receive_buffer_bytes (granted size).
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
