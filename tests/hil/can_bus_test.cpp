// The real drivers on a real CAN stack and a real LCM bus, as root of a guest: see in_guest.sh.

#include "tests/hil/can_bus_fixture.hpp"

namespace seastitch {
namespace {

int Seconds() {
  const char* const text = std::getenv("SEASTITCH_HIL_SECONDS");
  return text == nullptr ? 60 : std::atoi(text);
}

CanFrame Foreign(int i) {
  CanFrame frame;
  frame.id = 0x7A0 + static_cast<std::uint32_t>(i % 16);
  frame.SetData(std::vector<std::uint8_t>(8, static_cast<std::uint8_t>(i)));
  return frame;
}

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

}  // namespace
}  // namespace seastitch
