#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/tty.h>
#include <net/if.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <map>
#include <thread>

#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/socket/candump.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/support/paths.hpp"

// A driver on a real CAN bus.
namespace seastitch {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::HasSubstr;

inline void Shell(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

class CanWriter {
 public:
  explicit CanWriter(const std::string& interface) : fd_(socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    setsockopt(fd_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0);  // it only sends
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    EXPECT_EQ(bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  void Send(const CanFrame& frame) {
    can_frame out{};
    out.can_id = IdWord(frame);
    out.len = frame.length;
    std::memcpy(out.data, frame.bytes.data(), frame.length);
    EXPECT_EQ(write(fd_.get(), &out, sizeof out), static_cast<ssize_t>(sizeof out));
    ++sent_;
  }
  int sent() const { return sent_; }

 private:
  FileDescriptor fd_;
  int sent_ = 0;
};

// What one driver put on RAW_CAN.
struct RawStream {
  std::vector<CanFrame> frames;
  std::map<std::size_t, std::int64_t>
      recv_utime;  // of the last frame of each message, by its index
  std::int64_t next_seq = 0;
  int gaps = 0;

  void Add(const raw_bytes_t& msg) {
    if (msg.seq != next_seq) ++gaps;
    next_seq = msg.seq + 1;
    const auto packet = DecodeCannelloni(msg.data);
    ASSERT_TRUE(packet);
    frames.insert(frames.end(), packet->frames.begin(), packet->frames.end());
    recv_utime[frames.size() - 1] = msg.recv_utime;
  }
};

class CanBus : public DriverProcess {
 protected:
  void SetUp() override {
    if (!FileDescriptor(socket(PF_CAN, SOCK_RAW, CAN_RAW)))
      GTEST_SKIP() << "this kernel has no CAN";
    ASSERT_TRUE(OpenBus());
    bus->Subscribe<raw_bytes_t>(
        "RAW_CAN", 0, [this](const raw_bytes_t& m) { raw[m.source].Add(m); });
    bus->Subscribe<imu_t>("IMU", 0, [this](const imu_t& m) { imu.push_back(m); });
    bus->Subscribe<dvl_t>("DVL", 0, [this](const dvl_t& m) { dvl.push_back(m); });
    bus->Subscribe<health_t>("HEALTH", 0, [this](const health_t& m) { health[m.process] = m; });
  }
  std::int64_t Count(const std::string& process, const std::string& counter) {
    for (const counter_t& c : health[process].counters)
      if (c.name == counter) return c.value;
    return 0;
  }
  bool UntilText(const std::string& process, const std::string& text) {
    return HandleUntil([&] { return health[process].text.find(text) != std::string::npos; },
                       60'000);
  }
  bool UntilState(const std::string& process, HealthState state) {
    return HandleUntil([&] { return health[process].state == static_cast<std::int8_t>(state); },
                       60'000);
  }
  std::unique_ptr<Process> StartImu(const std::string& source) {
    return Start("seastitch-imu-driver", WithSource(dir, "imu_driver.yaml", source));
  }
  // Until the drivers have published, and candump has written into the folder, what they were
  // behind with; and a HEALTH after that.
  void HandleUntilQuiet(const std::string& folder) {
    const auto progress = [&] {
      std::uintmax_t n = imu.size() + dvl.size();
      for (const auto& [source, stream] : raw) n += stream.frames.size();
      for (const auto& entry : std::filesystem::directory_iterator(folder)) n += entry.file_size();
      return n;
    };
    for (std::uintmax_t before = 0; before != progress();) {
      before = progress();
      HandleUntil([] { return false; }, 3000);
    }
  }
  // The next epoch of an inertial unit that stamps with our clock.
  std::vector<CanFrame> NextEpoch() {
    if (!encoder_) encoder_.emplace(imu_config.can.signals, FromUtime(NowUtime() - 1'000'000));
    ImuSample sample;
    sample.time = FromUtime(NowUtime());
    sample.angular_rate_radps = {0.001 * (num_epochs_++ % 1000), 0.0, 0.0};
    sample.specific_force_mps2 = {0.0, 0.0, -9.81};
    sample.attitude.emplace().sigma_rpy_rad = {0.001, 0.001, 0.01};
    return encoder_->Encode(sample);
  }
  // Sends epochs until one has come through.
  bool ImuComesThrough(const std::string& interface) {
    const std::size_t before = imu.size();
    CanWriter writer(interface);
    return HandleUntil(
        [&] {
          for (const CanFrame& frame : NextEpoch()) writer.Send(frame);
          return imu.size() > before;
        },
        60'000);
  }

  const ImuDriverConfig imu_config = LoadImuDriverConfig(ConfigFile("imu_driver.yaml"));
  const DvlDriverConfig dvl_config = LoadDvlDriverConfig(ConfigFile("dvl_driver.yaml"));
  std::map<std::string, RawStream> raw;
  std::vector<imu_t> imu;
  std::vector<dvl_t> dvl;
  std::map<std::string, health_t> health;

 private:
  std::optional<ImuCanEncoder> encoder_;
  int num_epochs_ = 0;
};

}  // namespace seastitch
