#include "drivers/imu/imu_can.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/core/pose.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'250'000;
constexpr Duration kPeriod = std::chrono::milliseconds(10);

ImuCanParams Shipped() { return LoadImuDriverConfig(ConfigFile("imu_driver.yaml")).can; }

// On the steps of the wire, so that it comes back exactly but for rounding.
ImuSample Sample(int i) {
  ImuSample sample;
  sample.time = FromUtime(kStart) + i * kPeriod;
  sample.angular_rate_radps = {0.001 * i, -0.002, 0.5};
  sample.specific_force_mps2 = {0.25, -0.01 * i, -9.81};
  Attitude attitude;
  attitude.q_ned_imu = RotationFromRpy(0.1, -0.05, 3.0);
  attitude.sigma_rpy_rad = {0.001, 0.002, 0.01};
  sample.attitude = attitude;
  return sample;
}

void ExpectSame(const ImuSample& a, const ImuSample& b) {
  EXPECT_EQ(ToUtime(a.time), ToUtime(b.time));
  EXPECT_LT((a.angular_rate_radps - b.angular_rate_radps).norm(), 1e-9);
  EXPECT_LT((a.specific_force_mps2 - b.specific_force_mps2).norm(), 1e-9);
  ASSERT_EQ(a.attitude.has_value(), b.attitude.has_value());
  if (!a.attitude) return;
  EXPECT_LT(a.attitude->q_ned_imu.angularDistance(b.attitude->q_ned_imu), 1e-6);
  EXPECT_LT((a.attitude->sigma_rpy_rad - b.attitude->sigma_rpy_rad).norm(), 1e-9);
}

class ImuCan : public testing::Test {
 protected:
  // Adds frames as they leave the device, 100 us apart from the sample's time on.
  std::vector<ImuSample> Feed(const std::vector<CanFrame>& frames, Time first_recv) {
    std::vector<ImuSample> samples;
    Time recv = first_recv;
    for (const CanFrame& frame : frames) {
      if (auto sample = decoder.Add(frame, recv)) samples.push_back(*sample);
      recv += Duration(100);
    }
    return samples;
  }
  std::vector<ImuSample> FeedSample(const ImuSample& sample) {
    return Feed(encoder.Encode(sample), sample.time + Duration(2000));
  }
  std::int64_t Count(const std::string& name) {
    const Counters counters = decoder.counters();
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }

  const ImuCanParams params = Shipped();
  ImuCanDecoder decoder{params};
  ImuCanEncoder encoder{params.signals, FromUtime(kStart - 5'000'000)};
};

TEST_F(ImuCan, EpochsComeBackWithTheDevicesTime) {
  for (int i = 0; i < 250; ++i) {
    const auto samples = FeedSample(Sample(i));
    ASSERT_EQ(samples.size(), 1u) << i;
    ExpectSame(samples[0], Sample(i));
  }
  EXPECT_TRUE(decoder.counters().empty());
}

TEST_F(ImuCan, ReadsGoldenFramesOfTheVendorsTable) {
  SKIP_WITHOUT(Shared("vectors/can"));
  ImuCanParams receive = params;
  receive.clock = {DeviceClock::kReceive, 0.004};
  ImuCanDecoder golden(receive);
  std::optional<ImuSample> sample;
  for (const auto& vector : ReadJson(Shared("vectors/can/sbg_ecan_vectors.json"))) {
    CanFrame frame;
    frame.id =
        static_cast<std::uint32_t>(std::stoul(vector["can_id"].get<std::string>(), nullptr, 16));
    frame.SetData(FromHex(vector["data"]));
    if (auto done = golden.Add(frame, FromUtime(kStart))) sample = done;
  }
  ASSERT_TRUE(sample);
  EXPECT_EQ(ToUtime(sample->time), kStart - 4000);
  EXPECT_LT((sample->specific_force_mps2 - Eigen::Vector3d(0.01, -2.5, -9.81)).norm(), 1e-12);
  EXPECT_LT((sample->angular_rate_radps - Eigen::Vector3d(0.001, -1.0, 32.767)).norm(), 1e-12);
  ASSERT_TRUE(sample->attitude);
  const Eigen::Quaterniond q(RotationFromRpy(-3.1416, 0.7854, 3.1415));
  EXPECT_LT(q.angularDistance(sample->attitude->q_ned_imu), 1e-7);
  EXPECT_LT((sample->attitude->sigma_rpy_rad - Eigen::Vector3d(0.001, 0.002, 3.1416)).norm(),
            1e-12);
}

TEST_F(ImuCan, MapsTheDevicesClockThroughTheGoldenUtcFrames) {
  SKIP_WITHOUT(Shared("vectors/can"));
  // UTC_0 and UTC_1 of the vectors: clock 4294967295 us at 2023-11-14 22:13:20.25.
  CanFrame frame;
  frame.id = 0x110;
  frame.SetData(FromHex("FFFFFFFFFA6C110F"));
  decoder.Add(frame, FromUtime(kStart));
  frame.id = 0x111;
  frame.SetData(FromHex("170B0E160D14C409"));
  decoder.Add(frame, FromUtime(kStart));
  // The clock wraps: 1 s later it reads 999999.
  std::vector<CanFrame> epoch = ImuCanEncoder(params.signals, FromUtime(kStart + 1)).Encode([] {
    ImuSample s = Sample(0);
    s.time = FromUtime(kStart + 1'000'000);
    return s;
  }());
  epoch.erase(epoch.begin(), epoch.begin() + 2);  // without UTC frames
  const auto samples = Feed(epoch, FromUtime(kStart + 1'002'000));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(ToUtime(samples[0].time), kStart + 1'000'000);
}

TEST_F(ImuCan, TimeRunsOnThroughTheWrapOfTheDevicesClock) {
  // Reads 0xFFFFFFFF 3.5 s after the first epoch.
  encoder = ImuCanEncoder(params.signals, FromUtime(kStart + 3'500'001 - 4'294'967'296));
  for (int i = 0; i < 1000; ++i) {
    const auto samples = FeedSample(Sample(i));
    ASSERT_EQ(samples.size(), 1u) << i;
    ASSERT_EQ(samples[0].time, Sample(i).time) << i;
  }
  EXPECT_TRUE(decoder.counters().empty());
}

TEST_F(ImuCan, TimeRunsOnForHoursAfterTheLastUtc) {
  ASSERT_EQ(FeedSample(Sample(0)).size(), 1u);
  for (int minute = 1; minute < 180; ++minute) {
    for (int second = 0; second < 60; second += 30) {
      ImuSample sample = Sample(0);
      sample.time += std::chrono::minutes(minute) + std::chrono::seconds(second);
      std::vector<CanFrame> frames = encoder.Encode(sample);
      std::erase_if(frames, [](const CanFrame& f) { return f.id == 0x110 || f.id == 0x111; });
      const auto samples = Feed(frames, sample.time);
      ASSERT_EQ(samples.size(), 1u);
      ASSERT_EQ(samples[0].time, sample.time) << minute;
    }
  }
}

TEST_F(ImuCan, EpochsBeforeTheFirstUtcAreCountedNotGiven) {
  std::vector<CanFrame> frames = encoder.Encode(Sample(0));
  frames.erase(frames.begin(), frames.begin() + 2);
  EXPECT_TRUE(Feed(frames, Sample(0).time).empty());
  EXPECT_EQ(Count("imu_epoch_unstamped"), 1);
}

TEST_F(ImuCan, ARestartOfTheDeviceWaitsForItsNextUtc) {
  ImuCanEncoder long_up(params.signals, FromUtime(kStart - 300'000'000));
  ASSERT_EQ(Feed(long_up.Encode(Sample(0)), Sample(0).time).size(), 1u);
  ImuCanEncoder restarted(params.signals, Sample(200).time);
  std::vector<CanFrame> frames = restarted.Encode(Sample(201));
  const std::vector<CanFrame> utc(frames.begin(), frames.begin() + 2);
  frames.erase(frames.begin(), frames.begin() + 2);
  EXPECT_TRUE(Feed(frames, Sample(201).time).empty());
  EXPECT_EQ(Count("imu_device_restarted"), 1);
  EXPECT_EQ(Count("imu_epoch_unstamped"), 1);
  Feed(utc, Sample(202).time);
  const auto samples = Feed(restarted.Encode(Sample(203)), Sample(203).time);
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(samples[0].time, Sample(203).time);
}

TEST_F(ImuCan, AnyLostFrameCostsItsOwnEpochOnlyAndNeverMixes) {
  // Frames of each epoch: INFO ACCEL GYRO INFO EULER ACC.
  for (std::size_t lost = 0; lost < 6; ++lost) {
    ImuCanDecoder fresh(params);
    ImuCanEncoder device(params.signals, FromUtime(kStart - 5'000'000));
    std::vector<ImuSample> samples;
    for (int i = 0; i < 20; ++i) {
      std::vector<CanFrame> frames = device.Encode(Sample(i));
      const std::size_t utc = frames.size() - 6;
      if (i == 10) frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(utc + lost));
      Time recv = Sample(i).time;
      for (const CanFrame& frame : frames)
        if (auto sample = fresh.Add(frame, recv += Duration(100))) samples.push_back(*sample);
    }
    // Only a lost attitude frame leaves something to give.
    EXPECT_EQ(samples.size(), lost < 3 ? 19u : 20u) << lost;
    for (const ImuSample& sample : samples) {
      const int i = static_cast<int>((sample.time - Sample(0).time) / kPeriod);
      ImuSample expected = Sample(i);
      if (i == 10) expected.attitude.reset();
      ExpectSame(sample, expected);
    }
  }
}

// Whatever is lost: what comes out is an epoch that went in, whole or without attitude.
TEST_F(ImuCan, RandomLossNeverMixesEpochs) {
  EXPECT_TRUE(rc::check([this] {
    const std::vector<std::uint8_t> dice =
        *rc::gen::container<std::vector<std::uint8_t>>(240, rc::gen::inRange<std::uint8_t>(0, 10));
    const int odds = *rc::gen::inRange(1, 9);
    ImuCanDecoder fresh(params);
    ImuCanEncoder device(params.signals, FromUtime(kStart - 5'000'000));
    std::size_t die = 0;
    for (int i = 0; i < 40; ++i) {
      Time recv = Sample(i).time;
      for (const CanFrame& frame : device.Encode(Sample(i))) {
        recv += Duration(100);
        const bool utc = frame.id == 0x110 || frame.id == 0x111;
        if (!utc && dice[die++] < odds) continue;
        const auto sample = fresh.Add(frame, recv);
        if (!sample) continue;
        const int of = static_cast<int>((sample->time - Sample(0).time) / kPeriod);
        RC_ASSERT(std::abs(sample->angular_rate_radps.x() - 0.001 * of) < 1e-9);
        RC_ASSERT(std::abs(sample->specific_force_mps2.y() + 0.01 * of) < 1e-9);
      }
    }
  }));
}

TEST_F(ImuCan, AnUtcPairOfTwoInstantsIsRefused) {
  const std::vector<CanFrame> first = encoder.Encode(Sample(0));
  decoder.Add(first[0], Sample(0).time);  // UTC_0; its UTC_1 is lost
  ImuCanEncoder later(params.signals, FromUtime(kStart - 5'000'000));
  const std::vector<CanFrame> second = later.Encode(Sample(100));
  decoder.Add(second[1], Sample(100).time);  // UTC_1 a second later; its UTC_0 is lost
  EXPECT_EQ(Count("imu_utc_malformed"), 1);
  EXPECT_TRUE(Feed({second.begin() + 2, second.end()}, Sample(100).time).empty());
}

TEST_F(ImuCan, AnImpossibleCalendarIsRefused) {
  std::vector<CanFrame> frames = encoder.Encode(Sample(0));
  frames[1].bytes[1] = 13;  // month
  EXPECT_TRUE(Feed(frames, Sample(0).time).empty());
  EXPECT_EQ(Count("imu_utc_malformed"), 1);
}

TEST_F(ImuCan, AStepOfTheDevicesUtcIsCounted) {
  ASSERT_EQ(FeedSample(Sample(0)).size(), 1u);
  ImuCanEncoder stepped(params.signals, FromUtime(kStart - 5'000'000 + 250'000));
  ASSERT_EQ(Feed(stepped.Encode(Sample(100)), Sample(100).time).size(), 1u);
  EXPECT_EQ(Count("imu_utc_stepped"), 1);
}

TEST_F(ImuCan, ShortFramesAreCountedAndForeignOnesIgnored) {
  std::vector<CanFrame> frames = encoder.Encode(Sample(0));
  frames[3].length = 5;  // IMU_ACCEL
  CanFrame foreign;
  foreign.id = 0x7AB;
  frames.push_back(foreign);
  EXPECT_TRUE(Feed(frames, Sample(0).time).empty());
  EXPECT_EQ(Count("imu_frame_malformed"), 1);
}

TEST_F(ImuCan, WithoutAttitudeMappedEpochsNeedNone) {
  ImuCanParams bare = params;
  bare.signals = SignalMap();
  const Dbc dbc = Dbc::Load(ConfigFile("sbg_ecan.dbc"));
  bare.clock.clock = DeviceClock::kReceive;
  bare.signals.Assign(dbc, kImuTimeUs, "IMU_INFO.TIME_STAMP");
  for (int axis = 0; axis < 3; ++axis) {
    const std::string letter(1, static_cast<char>('X' + axis));
    bare.signals.Assign(
        dbc, kAngularRateX + static_cast<std::size_t>(axis), "IMU_GYRO.GYRO_" + letter);
    bare.signals.Assign(
        dbc, kSpecificForceX + static_cast<std::size_t>(axis), "IMU_ACCEL.ACCEL_" + letter);
  }
  ASSERT_EQ(bare.Validate(), "");
  decoder = ImuCanDecoder(bare);
  const auto samples = FeedSample(Sample(3));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_FALSE(samples[0].attitude);
  EXPECT_TRUE(decoder.counters().empty());
}

TEST_F(ImuCan, AZeroSigmaIsHalfAStepNotCertainty) {
  ImuSample sample = Sample(0);
  sample.attitude->sigma_rpy_rad.setZero();
  const auto samples = FeedSample(sample);
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_DOUBLE_EQ(samples[0].attitude->sigma_rpy_rad.x(), 0.00005);
}

TEST_F(ImuCan, FinishGivesTheLastEpochWithoutItsAttitude) {
  std::vector<CanFrame> frames = encoder.Encode(Sample(0));
  frames.pop_back();
  EXPECT_TRUE(Feed(frames, Sample(0).time).empty());
  const auto last = decoder.Finish();
  ASSERT_TRUE(last);
  EXPECT_FALSE(last->attitude);
  EXPECT_FALSE(decoder.Finish());
}

TEST_F(ImuCan, AlignmentIsThatOfTheLastStatusAndUnknownWhenItIsOld) {
  EXPECT_EQ(FeedSample(Sample(0)).at(0).alignment, HeadingAlignment::kUnknown);
  // STATUS_03: bit 27 of its solution word is set where the unit has found north.
  const auto status = [this](std::uint8_t bits_24_to_31, Time recv) {
    CanFrame frame;
    frame.id = 0x102;
    frame.SetData(std::vector<std::uint8_t>{0, 0, 0, bits_24_to_31, 0, 0});
    EXPECT_FALSE(decoder.Add(frame, recv));
  };
  status(0xF7, Sample(1).time);
  EXPECT_EQ(FeedSample(Sample(1)).at(0).alignment, HeadingAlignment::kAligning);
  status(0x08, Sample(2).time);
  EXPECT_EQ(FeedSample(Sample(2)).at(0).alignment, HeadingAlignment::kAligned);
  ImuSample late = Sample(3);
  late.time += std::chrono::seconds(6);
  EXPECT_EQ(FeedSample(late).at(0).alignment, HeadingAlignment::kUnknown);
}

TEST_F(ImuCan, AlignmentComesBack) {
  for (const HeadingAlignment alignment :
       {HeadingAlignment::kAligning, HeadingAlignment::kAligned}) {
    ImuSample sample = Sample(static_cast<int>(alignment));
    sample.alignment = alignment;
    FeedSample(sample);
    EXPECT_EQ(FeedSample(Sample(5 + static_cast<int>(alignment))).at(0).alignment, alignment);
  }
}

// The Xsens MTi-600: a group of frames that a counter numbers, big-endian, other axes.
ImuCanParams Xsens(DeviceClock clock) {
  ImuCanParams params = LoadImuDriverConfig(ConfigFile("imu_xsens_mti600.yaml")).can;
  params.clock.clock = clock;
  return params;
}

// Within half a step of the wire of Sample(i), whose sigmas the unit does not send.
bool IsXsensSample(const ImuSample& sample, int i) {
  const ImuSample sent = Sample(i);
  return std::abs(ToUtime(sample.time) - ToUtime(sent.time)) <= 100 &&
         (sample.angular_rate_radps - sent.angular_rate_radps).cwiseAbs().maxCoeff() <= 0.001 &&
         (sample.specific_force_mps2 - sent.specific_force_mps2).cwiseAbs().maxCoeff() <= 0.002 &&
         sample.attitude &&
         sample.attitude->q_ned_imu.angularDistance(sent.attitude->q_ned_imu) < 2e-4;
}

TEST(XsensCan, GoldenFramesInOurAxes) {
  SKIP_WITHOUT(Shared("vectors/can"));
  std::map<std::string, nlohmann::json> golden;
  ImuCanDecoder decoder(Xsens(DeviceClock::kReceive));
  std::optional<ImuSample> sample;
  for (const auto& vector : ReadJson(Shared("vectors/can/xsens_mti600_vectors.json"))) {
    golden[vector["name"]] = vector;
    CanFrame frame;
    frame.id =
        static_cast<std::uint32_t>(std::stoul(vector["can_id"].get<std::string>(), nullptr, 16));
    frame.SetData(FromHex(vector["data"]));
    if (const auto given = decoder.Add(frame, FromUtime(kStart))) sample = given;
  }
  ASSERT_TRUE(sample);
  // Big-endian i16 of the frames themselves, by the factors of the maker's table.
  const auto raw = [&golden](const std::string& name, std::size_t i) {
    const auto bytes = FromHex(golden.at(name)["data"]);
    return static_cast<double>(ByteReader(Bytes(bytes).subspan(2 * i)).Be<std::int16_t>());
  };
  for (const Eigen::Index i : {0, 1, 2}) {
    const double sign = i == 0 ? 1.0 : -1.0;
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(sample->angular_rate_radps[i], sign * raw("RateOfTurn", k) / 512.0, 1e-12);
    EXPECT_NEAR(sample->specific_force_mps2[i], sign * raw("Acceleration", k) / 256.0, 1e-12);
  }
  const auto euler = [&raw](std::size_t i) { return Deg2Rad(raw("EulerAngles", i) / 128.0); };
  const Eigen::Quaterniond q(RotationFromRpy(euler(0), -euler(1), kPi / 2.0 - euler(2)));
  ASSERT_TRUE(sample->attitude);
  EXPECT_LT(sample->attitude->q_ned_imu.angularDistance(q), 1e-9);
  EXPECT_NEAR(sample->attitude->sigma_rpy_rad.z(), Deg2Rad(1.0), 1e-12);
}

TEST(XsensCan, OurDbcReadsEveryGoldenFrameAsTheTableSays) {
  SKIP_WITHOUT(Shared("vectors/can"));
  const Dbc dbc = Dbc::Load(ConfigFile("xsens_mti600.dbc"));
  int compared = 0;
  for (const auto& vector : ReadJson(Shared("vectors/can/xsens_mti600_vectors.json"))) {
    CanFrame frame;
    frame.id =
        static_cast<std::uint32_t>(std::stoul(vector["can_id"].get<std::string>(), nullptr, 16));
    frame.SetData(FromHex(vector["data"]));
    const auto decoded = dbc.Decode(frame);
    if (!decoded || decoded->values.size() != vector["signals"].size()) continue;
    EXPECT_EQ(decoded->message->name, vector["name"]);
    std::vector<double> expected;
    for (const auto& [name, value] : vector["signals"].items()) expected.push_back(value);
    std::vector<double> values;
    for (const Dbc::Value& value : decoded->values) values.push_back(value.physical);
    if (vector["name"] == "UTC") continue;  // years and 0.1 ms in other units there
    // The names are ours; the values are theirs, in whatever order the file has them.
    std::sort(expected.begin(), expected.end());
    std::sort(values.begin(), values.end());
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_NEAR(values[i], expected[i], 1e-9 * std::max(1.0, std::abs(expected[i])))
          << vector["name"];
    compared += static_cast<int>(values.size());
  }
  EXPECT_GT(compared, 25);
}

TEST(XsensCan, AlignedIsAValidFilter) {
  const ImuCanParams params = Xsens(DeviceClock::kReceive);
  ImuCanDecoder decoder(params);
  ImuCanEncoder encoder(params.signals, FromUtime(kStart));
  int epoch = 0;
  for (const auto& [bits, alignment] :
       {std::pair{0x02, HeadingAlignment::kAligned}, {0xFD, HeadingAlignment::kAligning}}) {
    const ImuSample sent = Sample(++epoch);
    CanFrame status;
    status.id = 0x11;  // big-endian: bit 1 is in its last byte
    status.SetData(std::vector<std::uint8_t>{0, 0, 0, static_cast<std::uint8_t>(bits)});
    decoder.Add(status, sent.time);
    std::optional<ImuSample> given;
    for (const CanFrame& frame : encoder.Encode(sent))
      if (const auto sample = decoder.Add(frame, sent.time)) given = sample;
    if (!given) given = decoder.Finish();
    ASSERT_TRUE(given);
    EXPECT_EQ(given->alignment, alignment);
  }
}

TEST(XsensCan, EpochsComeBackByTheUnitsUtc) {
  const ImuCanParams params = Xsens(DeviceClock::kDevice);
  ImuCanDecoder decoder(params);
  ImuCanEncoder encoder(params.signals, FromUtime(kStart - 5'000'000));
  for (int i = 0; i < 100; ++i) {
    std::optional<ImuSample> sample;
    for (const CanFrame& frame : encoder.Encode(Sample(i)))
      if (const auto given = decoder.Add(frame, Sample(i).time + Duration(3000))) sample = given;
    ASSERT_TRUE(sample) << i;
    EXPECT_TRUE(IsXsensSample(*sample, i)) << i;
  }
  EXPECT_TRUE(decoder.counters().empty());
}

TEST(XsensCan, LostFramesInAnyOrderOfAGroupNeverMixEpochs) {
  EXPECT_TRUE(rc::check([] {
    const ImuCanParams params = Xsens(DeviceClock::kDevice);
    ImuCanDecoder decoder(params);
    ImuCanEncoder encoder(params.signals, FromUtime(kStart - 5'000'000));
    int given = 0;
    int whole = 0;
    for (int i = 0; i < 60; ++i) {
      std::vector<CanFrame> frames = encoder.Encode(Sample(i));
      // Either opening frame may come first.
      if (*rc::gen::arbitrary<bool>()) std::swap(frames[0], frames[1]);
      bool lost = false;
      for (std::size_t k = 0; k < frames.size(); ++k) {
        if (*rc::gen::weightedElement<bool>({{14, false}, {1, true}})) {
          lost = true;
          continue;
        }
        const Time recv = Sample(i).time + Duration(3000 + 500 * static_cast<int>(k));
        const auto sample = decoder.Add(frames[k], recv);
        if (!sample) continue;
        ++given;
        // Whichever epoch its time names, all of it is of that one.
        const auto of = static_cast<int>(
            std::llround(static_cast<double>(ToUtime(sample->time) - kStart) / 10'000.0));
        RC_ASSERT(of >= 0);
        RC_ASSERT(of <= i);
        ImuSample filled = *sample;
        if (!filled.attitude) filled.attitude = Sample(of).attitude;
        RC_ASSERT(IsXsensSample(filled, of));
      }
      whole += lost ? 0 : 1;
    }
    RC_ASSERT(given >= whole - 1);  // the first has no UTC before its own
  }));
}

TEST(XsensCan, ATickOfAHundredMicrosecondsIsAFactor) {
  const Dbc dbc = Dbc::Load(ConfigFile("xsens_mti600.dbc"));
  SignalMap map;
  map.Assign(dbc, kImuTimeUs, "SampleTime.Ticks * 100");
  CanFrame frame = dbc.Encode("SampleTime", {{"Ticks", 12345.0}});
  EXPECT_EQ(map.Read(frame)->values.value[kImuTimeUs], 1'234'500.0);
  map.Assign(dbc, kYaw, "EulerAngles.Yaw * -2 + 10");
  FieldValues values;
  values.Set(kYaw, 5.0);
  EXPECT_EQ(map.Read(map.Write(values)[0])->values.value[kYaw], 5.0);
  EXPECT_THROW(map.Assign(dbc, kYaw, "EulerAngles.Yaw * 2 + x"), std::runtime_error);
  EXPECT_THROW(map.Assign(dbc, kYaw, "EulerAngles.Yaw * 0"), std::runtime_error);
}

}  // namespace
}  // namespace seastitch
