#pragma once

#include <string>
#include <vector>

#include "drivers/socket/can_source.hpp"
#include "drivers/socket/patient_socket.hpp"

namespace seastitch {

// A SocketCAN interface. One that goes down is waited for on the same socket; one that is missing
// or unplugged is opened when it comes.
class SocketCanSource : public CanSource {
 public:
  // Throws std::runtime_error "can:can0: reason" where the kernel has no CAN.
  SocketCanSource(const std::string& interface,
                  const std::vector<CanFilter>& filters,
                  int receive_buffer_bytes);

  int fd() const override { return socket_.fd(); }
  std::vector<ReceivedFrame> Receive() override;
  std::string trouble() const override;
  std::int64_t outages() const override { return outages_; }
  // can_frames_dropped (receive buffer full), can_interface_down, can_interface_gone,
  // can_interface_back, can_receive_errors, can_frames_unstamped (by the kernel),
  // can_receive_buffer_bytes (granted).
  Counters counters() const override { return counters_; }

 private:
  FileDescriptor Open();

  std::string interface_;
  std::vector<CanFilter> filters_;
  int wanted_buffer_bytes_;
  std::uint32_t kernel_drops_ = 0;
  std::int64_t outages_ = 0;
  Counters counters_;
  PatientSocket socket_;
};

}  // namespace seastitch
