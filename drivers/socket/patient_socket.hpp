#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

// Why a socket cannot be had now, though perhaps later.
class NotYet : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A socket whose interface may be missing or whose port may be taken: opened as soon as it can be,
// tried every second, and again after it was lost.
class PatientSocket {
 public:
  // open: gives the socket; throws NotYet, or anything else where waiting is no use. name: for
  // people. logs: what becomes of it; else its owner does.
  using Open = std::function<FileDescriptor()>;
  PatientSocket(std::string name, Open open, bool logs = true);

  // Readable when the socket is, or when it is time to try again: call TryToOpen() first then.
  int fd() const { return poll_.get(); }
  // True where it just opened a socket that was not to be had before.
  bool TryToOpen();
  bool is_open() const { return static_cast<bool>(socket_); }
  int get() const { return socket_.get(); }
  // The socket is of no use any more.
  void Lose(const std::string& why);
  // Why there is none; empty where there is one.
  const std::string& trouble() const { return trouble_; }

 private:
  bool OpenNow();
  void SetTimer(bool on);

  std::string name_;
  Open open_;
  bool logs_;
  FileDescriptor poll_;   // an epoll of the two below
  FileDescriptor timer_;  // runs while there is no socket
  FileDescriptor socket_;
  std::string trouble_;
};

}  // namespace seastitch
