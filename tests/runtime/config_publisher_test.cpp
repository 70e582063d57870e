#include "common/runtime/config/config_publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/convert/convert.hpp"
#include "seastitch/config_request_t.hpp"

namespace seastitch {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

class ConfigPublisherTest : public testing::Test {
 protected:
  ConfigPublisherTest() {
    bus.Subscribe<config_t>("CONFIG", 0, [this](const config_t& msg) { got.push_back(msg); });
  }
  void Ask(const std::string& process) {
    config_request_t msg{};
    msg.process = process;
    bus.Publish("CONFIG_REQUEST", msg);
    bus.HandleAll();
  }
  // As the loop's timer does, for some seconds from now_s on.
  std::vector<config_t> SendFor(ConfigPublisher* publisher, double seconds) {
    got.clear();
    for (const double end_s = now_s + seconds; now_s < end_s; now_s += 0.1) {
      publisher->SendNext(now_s, static_cast<std::int64_t>(1e6 * now_s));
      bus.HandleAll();
    }
    return got;
  }

  Bus bus{"memq://"};
  std::vector<config_t> got;
  double now_s = 1000.0;
};

TEST_F(ConfigPublisherTest, SendsEveryFileAtTheStart) {
  ConfigPublisher publisher(
      ConfigParts("mapper", {{"mapper.yaml", "a: 1\n"}, {"vehicle.yaml", ""}}), &bus);
  EXPECT_THAT(SendFor(&publisher, 5.0), SizeIs(2));
  EXPECT_EQ(got[0].process, "mapper");
  EXPECT_FALSE(got[0].version.empty());
  EXPECT_EQ(got[0].name, "mapper.yaml");
  EXPECT_EQ(got[0].text, "a: 1\n");
  EXPECT_EQ(got[0].part, 0);
  EXPECT_EQ(got[0].num_parts, 1);
  EXPECT_EQ(got[0].utime, 1'000'000'000);
  EXPECT_EQ(got[1].name, "vehicle.yaml");
  EXPECT_EQ(got[1].text, "") << "an empty file is sent too";
  EXPECT_EQ(got[1].utime, got[0].utime);
}

TEST_F(ConfigPublisherTest, SplitsWhatIsLargeBetweenCharacters) {
  std::string text = "x";
  while (text.size() < 2 * std::size_t{kMaxConfigBytesPerPart}) text += "ü";
  ConfigPublisher publisher(ConfigParts("mapper", {{"mapper.yaml", text}}), &bus);
  ASSERT_THAT(SendFor(&publisher, 5.0), SizeIs(3));
  std::string whole;
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].part, static_cast<std::int32_t>(i));
    EXPECT_EQ(got[i].num_parts, 3);
    EXPECT_EQ(got[i].utime, got[0].utime);
    EXPECT_LT(got[i].getEncodedSize(), 60'000);
    EXPECT_NE(static_cast<unsigned char>(got[i].text[0]) & 0xC0, 0x80);
    whole += got[i].text;
  }
  EXPECT_EQ(whole, text);
}

TEST_F(ConfigPublisherTest, AnswersARequestOfItsOwnNameOrOfAll) {
  ConfigPublisher publisher(ConfigParts("mapper", {{"mapper.yaml", "a: 1\n"}}), &bus);
  EXPECT_THAT(SendFor(&publisher, 11.0), SizeIs(1));
  Ask("optimizer");
  EXPECT_THAT(SendFor(&publisher, 11.0), IsEmpty());
  Ask("mapper");
  EXPECT_THAT(SendFor(&publisher, 11.0), SizeIs(1));
  Ask("");
  EXPECT_THAT(SendFor(&publisher, 11.0), SizeIs(1));
}

TEST_F(ConfigPublisherTest, OfADriverSendsByTimerAndHearsNoRequest) {
  ConfigPublisher publisher(ConfigParts("imu-driver", {{"imu_driver.yaml", "a: 1\n"}}),
                            &bus,
                            ConfigPublisher::When::kByTimer);
  EXPECT_THAT(SendFor(&publisher, 7.0), SizeIs(1));
  Ask("imu-driver");
  EXPECT_THAT(SendFor(&publisher, 0.8), IsEmpty());
  EXPECT_THAT(SendFor(&publisher, 8.0), SizeIs(1));
  EXPECT_THAT(SendFor(&publisher, 8.0), SizeIs(1));
}

TEST_F(ConfigPublisherTest, AFloodOfRequestsIsAnsweredOnceInTenSeconds) {
  ConfigPublisher publisher(ConfigParts("mapper", {{"mapper.yaml", "a: 1\n"}}), &bus);
  std::size_t answers = 0;
  for (int i = 0; i < 1000; ++i) {  // 100 s
    Ask("");
    answers += SendFor(&publisher, 0.1).size();
  }
  EXPECT_GE(answers, 9u);
  EXPECT_LE(answers, 11u);
  EXPECT_THAT(SendFor(&publisher, 9.0), SizeIs(testing::Le(1u)));
  EXPECT_THAT(SendFor(&publisher, 100.0), IsEmpty()) << "1000 requests are owed one answer";
}

TEST_F(ConfigPublisherTest, ARequestWithinTheTenSecondsIsAnsweredAfterThem) {
  ConfigPublisher publisher(ConfigParts("mapper", {{"mapper.yaml", "a: 1\n"}}), &bus);
  EXPECT_THAT(SendFor(&publisher, 1.0), SizeIs(1));
  Ask("mapper");
  EXPECT_THAT(SendFor(&publisher, 8.0), IsEmpty());
  EXPECT_THAT(SendFor(&publisher, 2.0), SizeIs(1));
}

}  // namespace
}  // namespace seastitch
