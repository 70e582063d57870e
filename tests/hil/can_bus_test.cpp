// The real drivers on a real CAN stack and a real LCM bus, as root of a guest: see in_guest.sh.
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
#include "tests/paths.hpp"

namespace seastitch {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::HasSubstr;

void Shell(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

int Seconds() {
  const char* const text = std::getenv("SEASTITCH_HIL_SECONDS");
  return text == nullptr ? 60 : std::atoi(text);
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

CanFrame Foreign(int i) {
  CanFrame frame;
  frame.id = 0x7A0 + static_cast<std::uint32_t>(i % 16);
  frame.SetData(std::vector<std::uint8_t>(8, static_cast<std::uint8_t>(i)));
  return frame;
}

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

// The lines of a log that a driver's filters let through.
std::vector<CandumpLine> Logged(const std::string& log, const std::vector<CanFilter>& filters) {
  std::vector<CandumpLine> lines;
  std::ifstream in(log);
  for (std::string text; std::getline(in, text);) {
    const auto line = ParseCandumpLine(text);
    EXPECT_TRUE(line) << text;
    if (line && Passes(filters, line->frame)) lines.push_back(*line);
  }
  return lines;
}

void ExpectSameFrames(const RawStream& raw, const std::vector<CandumpLine>& logged) {
  EXPECT_EQ(raw.gaps, 0);
  ASSERT_EQ(raw.frames.size(), logged.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < logged.size(); ++i)
    if (!(raw.frames[i] == logged[i].frame)) ++different;
  EXPECT_EQ(different, 0u);
  // The kernel stamps a frame once, for every socket: equal stamps are its stamps.
  std::size_t stamped_otherwise = 0;
  for (const auto& [index, utime] : raw.recv_utime)
    if (utime != ToUtime(logged[index].time)) ++stamped_otherwise;
  EXPECT_EQ(stamped_otherwise, 0u) << "of " << raw.recv_utime.size();
}

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

// 400 Hz of inertial unit, 10 Hz of Doppler log, and other devices' frames up to 4000 a second.
// `received` is the number of the inertial unit's frames that this test has received on RAW_CAN.
// The sender stays at most 2 s ahead of it and never catches up in a burst: a guest that gets
// little of its machine is slow then, and its multicast buffers do not overflow.
void SendABusyBus(CanWriter* writer,
                  const ImuDriverConfig& imu,
                  const DvlDriverConfig& dvl,
                  int seconds,
                  const std::atomic<std::size_t>& received) {
  constexpr int kFramesPerTick = 40;
  constexpr int kMaxTicksAhead = 200;
  const Time start = FromUtime(NowUtime());
  ImuCanEncoder unit(imu.can.signals, start - std::chrono::seconds(10));
  const DvlCanEncoder log(dvl.can.signals);
  std::size_t sent_of_unit = 0;
  auto next = steady_clock::now();
  for (int tick = 0; tick < 100 * seconds; ++tick) {
    std::vector<CanFrame> frames;
    const auto append = [&frames](const std::vector<CanFrame>& more) {
      frames.insert(frames.end(), more.begin(), more.end());
    };
    for (int k = 0; k < 4; ++k) {
      ImuSample sample;
      sample.time = start + Duration(10'000 * tick + 2500 * k);
      sample.angular_rate_radps = {0.001 * (tick % 1000), 0.001 * k, 0.0};
      sample.attitude.emplace().sigma_rpy_rad = {0.001, 0.001, 0.01};
      append(unit.Encode(sample));
    }
    const std::size_t unit_frames_per_tick = frames.size();
    sent_of_unit += unit_frames_per_tick;
    if (tick % 10 == 0) {
      DvlSample sample;
      sample.time = start + Duration(10'000 * tick);
      sample.bottom_lock = true;
      sample.v_dvl_mps = {1.5, 0.0, 0.001 * (tick % 1000)};
      append(log.Encode(sample, std::nullopt));
    }
    for (const CanFrame& frame : frames) writer->Send(frame);
    for (auto n = static_cast<int>(frames.size()); n < kFramesPerTick; ++n)
      writer->Send(Foreign(tick + n));
    next = std::max(next + milliseconds(10), steady_clock::now());
    std::this_thread::sleep_until(next);
    const auto timeout = steady_clock::now() + std::chrono::seconds(60);
    while (sent_of_unit > received + kMaxTicksAhead * unit_frames_per_tick) {
      ASSERT_LT(steady_clock::now(), timeout) << "frames are lost for good";
      std::this_thread::sleep_for(milliseconds(10));
    }
  }
}

TEST_F(CanBus, CandumpAndLcmAgreeFrameByFrameAndNothingIsLost) {
  Shell("ip link add vcan0 type vcan && ip link set vcan0 up");
  const auto imu_driver = StartImu("can:vcan0");
  const auto dvl_driver =
      Start("seastitch-dvl-driver", WithSource(dir, "dvl_driver.yaml", "can:vcan0"));
  const std::string folder = dir.path().string();
  Process candump("sh",
                  {"-c", "cd " + folder + " && exec candump -l -r 67108864 vcan0"},
                  folder + "/candump.txt");
  ASSERT_TRUE(HandleUntil([&] { return health.size() == 2; }, 60'000));

  CanWriter writer("vcan0");
  std::atomic<bool> sent = false;
  std::atomic<std::size_t> received = 0;
  const auto began = steady_clock::now();
  std::thread sender([&] {
    SendABusyBus(&writer, imu_config, dvl_config, Seconds(), received);
    sent = true;
  });
  const auto all_sent = [&] {
    received = raw["can:vcan0#imu-driver"].frames.size();
    return sent.load();
  };
  EXPECT_TRUE(HandleUntil(all_sent, 5000 * Seconds()));
  sender.join();
  const double took_s = std::chrono::duration<double>(steady_clock::now() - began).count();
  HandleUntilQuiet(folder);
  EXPECT_EQ(imu_driver->Stop(), EXIT_SUCCESS) << imu_driver->Output();
  EXPECT_EQ(dvl_driver->Stop(), EXIT_SUCCESS) << dvl_driver->Output();
  candump.Stop();
  Shell("cat " + folder + "/candump-*.log > " + folder + "/all.log");
  const std::string log = folder + "/all.log";

  const std::vector<CanFilter> imu_ids = imu_config.can.signals.Filters();
  const std::vector<CanFilter> dvl_ids = dvl_config.can.signals.Filters();
  const auto imu_logged = Logged(log, imu_ids);
  const auto dvl_logged = Logged(log, dvl_ids);
  ExpectSameFrames(raw["can:vcan0#imu-driver"], imu_logged);
  ExpectSameFrames(raw["can:vcan0#dvl-driver"], dvl_logged);
  EXPECT_EQ(std::count(std::istreambuf_iterator<char>(std::ifstream(log).rdbuf()), {}, '\n'),
            writer.sent());

  // What was decoded live is what the log gives. (On a busy machine the guest stops for longer than
  // an epoch may take on a wire; such epochs are refused here as there.)
  ImuCanDecoder decoder(imu_config.can);
  std::vector<ImuSample> expected;
  for (const CandumpLine& line : imu_logged)
    if (const auto sample = decoder.Add(line.frame, line.time)) expected.push_back(*sample);
  ASSERT_EQ(imu.size(), expected.size());
  for (std::size_t i = 0; i < imu.size(); ++i) {
    EXPECT_EQ(imu[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(imu[i].utime, ToUtime(expected[i].time));
    EXPECT_EQ(imu[i].angular_rate_radps[0], expected[i].angular_rate_radps.x());
  }
  DvlCanDecoder dvl_decoder(dvl_config.can);
  std::vector<DvlSample> dvl_expected;
  for (const CandumpLine& line : dvl_logged)
    if (const auto sample = dvl_decoder.Add(line.frame, line.time).dvl)
      dvl_expected.push_back(*sample);
  ASSERT_EQ(dvl.size(), dvl_expected.size());
  for (std::size_t i = 0; i < dvl.size(); ++i) {
    EXPECT_EQ(dvl[i].utime, ToUtime(dvl_expected[i].time));
    EXPECT_EQ(dvl[i].v_dvl_mps[2], dvl_expected[i].v_dvl_mps.z());
  }
  for (const std::string process : {"imu-driver", "dvl-driver"}) {
    EXPECT_EQ(Count(process, "can_frames_dropped"), 0);
    EXPECT_EQ(Count(process, "can_frames_unstamped"), 0);
    EXPECT_EQ(Count(process, "bus_publish_errors"), 0);
    EXPECT_EQ(Count(process, "can_receive_buffer_bytes"), 8'388'608);
  }
  EXPECT_GE(writer.sent(), 4000 * Seconds());
  std::printf("%d frames in %.1f s, %.0f/s; %zu of %d IMU and %zu of %d DVL in time\n",
              writer.sent(),
              took_s,
              writer.sent() / took_s,
              imu.size(),
              400 * Seconds(),
              dvl.size(),
              10 * Seconds());
}

TEST_F(CanBus, AFloodOfForeignFramesNeverReachesTheDriver) {
  Shell("ip link add vcan1 type vcan && ip link set vcan1 up");
  const std::string config = WithSource(dir, "imu_driver.yaml", "can:vcan1");
  // A guest that was stopped in the middle of an epoch shall not be one fault more.
  Shell("sed -i 's/^max_epoch_s: .*/max_epoch_s: 1.0/' " + config);
  const auto driver = Start("seastitch-imu-driver", config);
  ASSERT_TRUE(HandleUntil([&] { return !health.empty(); }, 60'000));
  CanWriter writer("vcan1");
  for (int epoch = 0; epoch < 20; ++epoch) {
    for (int i = 0; i < 5000; ++i) writer.Send(Foreign(i));
    for (const CanFrame& frame : NextEpoch()) writer.Send(frame);
  }
  EXPECT_TRUE(HandleUntil([&] { return imu.size() == 20; }, 60'000));
  HandleUntil([] { return false; }, 1500);
  EXPECT_EQ(Count("imu-driver", "can_frames_dropped"), 0);
  EXPECT_EQ(raw["can:vcan1#imu-driver"].frames.size(),
            static_cast<std::size_t>(writer.sent()) - 20 * 5000);
}

TEST_F(CanBus, FramesThatOverrunTheBufferAreCountedExactly) {
  Shell("ip link add vcan2 type vcan && ip link set vcan2 up");
  const std::string config = WithSource(dir, "imu_driver.yaml", "can:vcan2");
  Shell("sed -i 's/^receive_buffer_bytes: .*/receive_buffer_bytes: 65536/' " + config);
  const auto driver = Start("seastitch-imu-driver", config);
  ASSERT_TRUE(HandleUntil([&] { return !health.empty(); }, 60'000));
  CanWriter writer("vcan2");
  driver->Signal(SIGSTOP);
  while (writer.sent() < 5000)
    for (const CanFrame& frame : NextEpoch()) writer.Send(frame);
  driver->Signal(SIGCONT);
  HandleUntil([] { return false; }, 1500);
  for (const CanFrame& frame : NextEpoch()) writer.Send(frame);  // the count comes with a frame
  HandleUntil([] { return false; }, 2500);
  const auto received = static_cast<std::int64_t>(raw["can:vcan2#imu-driver"].frames.size());
  EXPECT_GT(Count("imu-driver", "can_frames_dropped"), 0);
  EXPECT_EQ(received + Count("imu-driver", "can_frames_dropped"), writer.sent());
}

TEST_F(CanBus, AnInterfaceMayComeLateGoDownAndBePulled) {
  const auto driver = StartImu("can:vcan3");
  EXPECT_TRUE(UntilText("imu-driver", "no such interface"));
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kLost));
  Shell("ip link add vcan3 type vcan");
  EXPECT_TRUE(UntilText("imu-driver", "interface is down"));
  Shell("ip link set vcan3 up");
  EXPECT_TRUE(ImuComesThrough("vcan3"));
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kOk));

  Shell("ip link set vcan3 down");
  EXPECT_TRUE(UntilText("imu-driver", "interface is down"));
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kLost));
  Shell("ip link set vcan3 up");
  EXPECT_TRUE(ImuComesThrough("vcan3"));
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kOk));

  Shell("ip link del vcan3");
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kLost));
  EXPECT_TRUE(UntilText("imu-driver", "no such interface"));
  Shell("ip link add vcan3 type vcan && ip link set vcan3 up");
  EXPECT_TRUE(UntilText("imu-driver", "no usable data"));
  EXPECT_TRUE(HandleUntil([&] { return Count("imu-driver", "can_interface_back") == 2; }, 60'000));
  EXPECT_TRUE(ImuComesThrough("vcan3"));
  EXPECT_TRUE(UntilState("imu-driver", HealthState::kOk));
  EXPECT_EQ(Count("imu-driver", "can_interface_gone"), 1);
  EXPECT_GE(Count("imu-driver", "can_interface_down"), 2);
  EXPECT_EQ(driver->Stop(), EXIT_SUCCESS) << driver->Output();
}

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
