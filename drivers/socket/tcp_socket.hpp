#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/counters.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Reads from a device that serves its data over TCP. One that is not there yet, refuses, closes the
// connection or falls off the network is connected to again, every second.
class TcpSocket {
 public:
  // "tcp:HOST:PORT". Throws std::runtime_error "URL: reason".
  explicit TcpSocket(const std::string& url);
  TcpSocket(const TcpSocket&) = delete;
  TcpSocket& operator=(const TcpSocket&) = delete;

  int fd() const { return socket_.fd(); }
  // Takes what waits, cut wherever the network cut it; false where nothing does.
  bool Receive(Datagram* piece);
  // Gives up a connection that nobody answers. Call it once a second.
  void Check();
  // Why nothing can come, for people; empty while it is connected.
  const std::string& trouble() const { return trouble_; }

  // tcp_connections (made so far), tcp_lost (of these).
  const Counters& counters() const { return counters_; }

 private:
  FileDescriptor Open();
  void SetConnected();
  void Lose(const std::string& why);

  SourceUrl url_;
  sockaddr_in address_;
  std::vector<std::uint8_t> buffer_;
  std::string trouble_ = "not connected";
  int checks_ = 0;  // since it asked for the connection
  Counters counters_;
  PatientSocket socket_;
};

}  // namespace seastitch
