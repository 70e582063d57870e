#include "tests/hil/can_bus_fixture.hpp"

namespace seastitch {
namespace {

// A serial-line CAN adapter (Lawicel's text protocol) at the other end of a pseudo terminal: the
// only interface here whose controller can be in trouble.
class SerialAdapter {
 public:
  SerialAdapter() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    grantpt(master_.get());
    unlockpt(master_.get());
    slave_ = FileDescriptor(open(ptsname(master_.get()), O_RDWR | O_NOCTTY));
    termios raw{};
    tcgetattr(slave_.get(), &raw);
    cfmakeraw(&raw);
    tcsetattr(slave_.get(), TCSANOW, &raw);
    const int discipline = N_SLCAN;
    ifreq request{};
    EXPECT_EQ(ioctl(slave_.get(), TIOCSETD, &discipline), 0);
    EXPECT_EQ(ioctl(slave_.get(), SIOCGIFNAME, request.ifr_name), 0);
    interface_ = request.ifr_name;
    reader_ = std::thread([this] {  // swallows the host's commands: open, close, bit rate
      std::array<char, 256> buffer{};
      while (!done_)
        if (WaitReadable(master_.get(), 50) && read(master_.get(), buffer.data(), 256) < 0) return;
    });
  }
  ~SerialAdapter() {
    done_ = true;
    reader_.join();
  }
  const std::string& interface() const { return interface_; }
  void Up() const {
    Shell("ip link set " + interface_ + " type can bitrate 500000 && ip link set " + interface_ +
          " up");
  }
  void Down() const { Shell("ip link set " + interface_ + " down"); }

  // "sp" with two counters of three digits: the controller's state; "e1a": an error on the wire.
  void Say(const std::string& line) const {
    const std::string text = line + "\r";
    EXPECT_EQ(write(master_.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void Receive(const CanFrame& frame) const {
    std::array<char, 64> text{};
    int n = std::snprintf(text.data(), text.size(), "t%03X%d", frame.id, frame.length);
    for (const std::uint8_t byte : frame.data())
      n += std::snprintf(&text[static_cast<std::size_t>(n)], 3, "%02X", byte);
    Say(text.data());
  }

 private:
  FileDescriptor master_;
  FileDescriptor slave_;
  std::string interface_;
  std::atomic<bool> done_ = false;
  std::thread reader_;
};

TEST_F(CanBus, TroubleOfTheControllerIsSaidUntilItIsOver) {
  const SerialAdapter adapter;
  adapter.Up();
  const auto driver = StartImu("can:" + adapter.interface());
  ASSERT_TRUE(HandleUntil([&] { return !health.empty(); }, 60'000));
  const auto imu_comes_through = [&] {
    const std::size_t before = imu.size();
    return HandleUntil(
        [&] {
          for (const CanFrame& frame : NextEpoch()) adapter.Receive(frame);
          return imu.size() > before;
        },
        60'000);
  };
  EXPECT_TRUE(imu_comes_through());
  adapter.Say("e1a");
  EXPECT_TRUE(HandleUntil([&] { return Count("imu-driver", "can_no_ack") == 1; }, 60'000));
  adapter.Say("sp130000");
  EXPECT_TRUE(imu_comes_through());
  EXPECT_TRUE(UntilText("imu-driver", "controller is error-passive"));
  adapter.Say("sb256256");
  EXPECT_TRUE(UntilText("imu-driver", "controller is bus-off"));
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kLost));
  EXPECT_EQ(Count("imu-driver", "can_bus_off"), 1);
  EXPECT_EQ(Count("imu-driver", "can_error_passive"), 1);

  adapter.Down();
  EXPECT_TRUE(UntilText("imu-driver", "interface is down"));
  adapter.Up();
  EXPECT_TRUE(imu_comes_through());
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kOk));
  EXPECT_EQ(driver->Stop(), EXIT_SUCCESS) << driver->Output();
}

TEST_F(CanBus, ASonarsInterfaceMayComeLateAndBePulled) {
  const std::string source = "udp:239.255.43.21:6020?interface=sonar0";
  const auto driver = Start("seastitch-mbes-driver", WithSource(dir, "mbes_driver.yaml", source));
  std::uint8_t heard = 0;  // the last datagram
  bus->Subscribe<raw_bytes_t>(
      "RAW_MBES", 0, [&](const raw_bytes_t& m) { heard = m.data.empty() ? 0 : m.data[0]; });
  const auto sonar_is_heard = [&](std::uint8_t says) {
    Shell(
        "ip link add sonar0 type dummy && ip addr add 192.168.9.1/24 dev sonar0 && ip link set "
        "sonar0 up");
    const FileDescriptor sonar(socket(AF_INET, SOCK_DGRAM, 0));
    ip_mreqn from{};
    from.imr_ifindex = static_cast<int>(if_nametoindex("sonar0"));
    setsockopt(sonar.get(), IPPROTO_IP, IP_MULTICAST_IF, &from, sizeof from);
    sockaddr_in group{};
    group.sin_family = AF_INET;
    group.sin_port = htons(6020);
    inet_pton(AF_INET, "239.255.43.21", &group.sin_addr);
    return HandleUntil(
        [&] {
          sendto(sonar.get(), &says, 1, 0, reinterpret_cast<const sockaddr*>(&group), sizeof group);
          return heard == says;
        },
        60'000);
  };
  EXPECT_TRUE(UntilText("mbes-driver", "no such interface: sonar0"));
  EXPECT_TRUE(sonar_is_heard(1));
  Shell("ip link del sonar0");
  EXPECT_TRUE(sonar_is_heard(2));
  Shell("ip link del sonar0");
  EXPECT_TRUE(UntilText("mbes-driver", "no such interface: sonar0"));
  EXPECT_TRUE(sonar_is_heard(3));
  EXPECT_EQ(Count("mbes-driver", "udp_interface_gone"), 2);
  EXPECT_EQ(driver->Stop(), EXIT_SUCCESS) << driver->Output();
}

TEST_F(CanBus, WithoutItsLcmNetworkADriverRunsOnAndCounts) {
  Shell("ip link add vcan4 type vcan && ip link set vcan4 up");
  const std::string config = WithSource(dir, "imu_driver.yaml", "can:vcan4");
  // A guest that was stopped in the middle of an epoch shall not be one fault more.
  Shell("sed -i 's/^max_epoch_s: .*/max_epoch_s: 1.0/' " + config);
  const auto driver = Start("seastitch-imu-driver", config);
  ASSERT_TRUE(HandleUntil([&] { return !health.empty(); }, 60'000));
  EXPECT_TRUE(ImuComesThrough("vcan4"));
  HandleUntil([] { return false; }, 500);
  Shell("ip route del 224.0.0.0/4 dev lo");
  CanWriter writer("vcan4");
  const std::size_t before = imu.size();
  for (int i = 0; i < 50; ++i) {
    for (const CanFrame& frame : NextEpoch()) writer.Send(frame);
    HandleUntil([] { return false; }, 20);
  }
  EXPECT_EQ(imu.size(), before);
  Shell("ip route add 224.0.0.0/4 dev lo");
  EXPECT_TRUE(ImuComesThrough("vcan4"));
  // The jump in seq tells a subscriber what the counter tells HEALTH.
  EXPECT_EQ(imu.back().seq - imu[before - 1].seq - static_cast<std::int64_t>(imu.size() - before),
            50);
  HandleUntil([] { return false; }, 1500);
  EXPECT_GE(Count("imu-driver", "bus_publish_errors"), 100);  // IMU and RAW_CAN
  EXPECT_EQ(driver->Stop(), EXIT_SUCCESS) << driver->Output();
}

}  // namespace
}  // namespace seastitch
