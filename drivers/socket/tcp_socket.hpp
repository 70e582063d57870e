#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Reads from a device that serves its data over TCP. While there is no connection (device off,
// connection refused, closed or lost), it tries to connect every second.
class TcpSocket {
 public:
  // "tcp:HOST:PORT". Throws std::runtime_error "URL: reason".
  explicit TcpSocket(const std::string& url);
  TcpSocket(const TcpSocket&) = delete;
  TcpSocket& operator=(const TcpSocket&) = delete;

  int fd() const { return socket_.fd(); }
  // Takes the bytes that were received; the network may cut a message anywhere. False if there are
  // none.
  bool Receive(Datagram* piece);
  // Ends a connection whose other side does not answer. Call it once a second.
  void Check();
  // Why no data can come, for people; empty while connected.
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
