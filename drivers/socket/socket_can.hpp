#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "drivers/socket/can_source.hpp"
#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

// A SocketCAN interface. An interface that goes down is waited for on the same socket; one that is
// unplugged is opened again when it is back.
class SocketCanSource : public CanSource {
 public:
  // Throws std::runtime_error "can:can0: reason".
  SocketCanSource(const std::string& interface,
                  const std::vector<CanFilter>& filters,
                  int receive_buffer_bytes);

  int fd() const override { return poll_.get(); }
  std::vector<ReceivedFrame> Receive() override;
  // can_frames_dropped (receive buffer full), can_interface_down, can_interface_gone,
  // can_interface_back, can_receive_errors, can_receive_buffer_bytes (granted).
  Counters counters() const override { return counters_; }

 private:
  void Open();
  void Close();
  void TryOpenAgain();

  std::string interface_;
  std::vector<CanFilter> filters_;
  int wanted_buffer_bytes_;
  // An epoll: readable when the socket is, or when it is time to look for the interface again.
  FileDescriptor poll_;
  FileDescriptor retry_timer_;
  FileDescriptor socket_;
  std::uint32_t kernel_drops_ = 0;
  Counters counters_;
};

}  // namespace seastitch
