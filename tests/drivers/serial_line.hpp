#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>
#include <utility>

#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

// Our end of a serial line; the process under test opens a link to the other, as udev makes them.
class SerialLine {
 public:
  explicit SerialLine(std::filesystem::path link) : link_(std::move(link)) { Plug(); }
  void Plug() {
    int instrument = -1, port = -1;
    ASSERT_EQ(openpty(&instrument, &port, nullptr, nullptr, nullptr), 0);
    for (const int fd : {instrument, port}) fcntl(fd, F_SETFD, FD_CLOEXEC);
    instrument_ = FileDescriptor(instrument);
    port_ = FileDescriptor(port);
    std::filesystem::remove(link_);
    std::filesystem::create_symlink(ttyname(port), link_);
  }
  void Unplug() {
    std::filesystem::remove(link_);
    port_ = FileDescriptor();
    instrument_ = FileDescriptor();
  }
  void Send(const std::string& text) const {
    EXPECT_EQ(write(instrument_.get(), text.data(), text.size()),
              static_cast<ssize_t>(text.size()));
  }
  // What has arrived.
  std::string Receive() const {
    std::array<char, 4096> buffer;
    const ssize_t size = read(instrument_.get(), buffer.data(), buffer.size());
    return size > 0 ? std::string(buffer.data(), static_cast<std::size_t>(size)) : "";
  }
  int fd() const { return instrument_.get(); }
  // The rate that the process has set.
  speed_t rate() const {
    termios settings{};
    tcgetattr(port_.get(), &settings);
    return cfgetispeed(&settings);
  }

 private:
  std::filesystem::path link_;
  FileDescriptor instrument_, port_;
};

}  // namespace seastitch
