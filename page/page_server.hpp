#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "page/page_feed.hpp"

namespace seastitch {

// An address to listen at: "127.0.0.1:8642". Port 0: any free one.
struct ListenAddress {
  std::string host;
  int port = 0;
};
// Throws std::runtime_error where the text is not ADDRESS:PORT, an IPv4 address and a port.
ListenAddress ParseListenAddress(const std::string& text);
bool IsLoopback(const ListenAddress& address);

// Serves the page of a vehicle to browsers by HTTP: / (the page), /events (the state once a second)
// and /map.json. It answers GET alone, knows no other URL, and reads no file. A request whose Host
// is a name other than localhost is refused, so that a web site cannot read the page by a name of
// its own for this address.
//
// It has threads of its own: at most kMostClients browsers follow the events, and as many requests
// beside them are answered at once. A client that neither sends nor reads for some seconds is
// dropped.
class PageServer {
 public:
  static constexpr int kMostClients = 8;

  // Throws std::runtime_error where it cannot listen. The feed outlives it.
  PageServer(const ListenAddress& address, PageFeed* feed);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  int port() const;
  int clients() const;           // that follow the events
  std::int64_t refused() const;  // requests, for any reason

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace seastitch
