#pragma once

#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_dir.hpp"

namespace seastitch {

// Where a service manager listens: what this process notifies arrives here.
class NotifySocket {
 public:
  NotifySocket() : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const std::string path = (dir_ / "notify").string();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("bind " + path);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~NotifySocket() {
    unsetenv("NOTIFY_SOCKET");
    close(fd_);
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  // How often the watchdog was fed since the last call.
  int Feedings() {
    int feedings = 0;
    std::array<char, 8192> buffer{};
    for (ssize_t size = 0; (size = recv(fd_, buffer.data(), buffer.size(), 0)) >= 0;) {
      const std::string text(buffer.data(), static_cast<std::size_t>(size));
      if (text.find("WATCHDOG=1") == std::string::npos) continue;
      ++feedings;
      last_ = text;
    }
    return feedings;
  }
  // What came with the last of them.
  const std::string& last() const { return last_; }

 private:
  TemporaryDir dir_;
  int fd_;
  std::string last_;
};

}  // namespace seastitch
