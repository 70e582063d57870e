#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

// Reason why a socket cannot be opened now, but perhaps later.
class NotYet : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A socket whose interface may be missing, or whose port may be in use. It is opened as soon as
// possible, with a try every second, and opened again after it was lost.
class PatientSocket {
 public:
  // open: opens the socket; throws NotYet, or anything else if waiting is useless. name: for
  // people. logs: writes log lines; otherwise its owner does.
  using Open = std::function<FileDescriptor()>;
  PatientSocket(std::string name, Open open, bool logs = true);

  // Readable when the socket is, or when it is time for another try: call TryToOpen() first then.
  int fd() const { return poll_.get(); }
  // True if this call opened the socket.
  bool TryToOpen();
  bool is_open() const { return static_cast<bool>(socket_); }
  int get() const { return socket_.get(); }
  // Call it when the socket cannot be used any more.
  void Lose(const std::string& why);
  // Reason why there is no socket; empty if there is one.
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
