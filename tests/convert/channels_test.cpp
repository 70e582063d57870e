#include "common/convert/channels.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/convert/example_messages.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

TEST(Channels, HaveAnExampleOfEachAndReadItsPlaceAsTheTypeDoes) {
  std::set<std::string> seen;
  examples::ForEach([&seen](const char* name, const auto& msg) {
    seen.insert(name);
    const Channel* channel = FindChannel(name);
    ASSERT_NE(channel, nullptr) << name;
    EXPECT_STREQ(channel->type, msg.getTypeName());
    const std::vector<std::uint8_t> bytes = examples::Encoded(msg);
    EXPECT_EQ(FingerprintOf(bytes), channel->fingerprint) << name;
    EXPECT_TRUE(channel->decodes(bytes)) << name;
    const std::optional<MessagePlace> place = PlaceOf(bytes);
    ASSERT_TRUE(place) << name;
    EXPECT_EQ(place->seq, msg.seq) << name;
    EXPECT_EQ(place->seq, 42) << name;
    if constexpr (requires { msg.utime; }) {
      EXPECT_EQ(place->utime, msg.utime) << name;
    } else {
      EXPECT_FALSE(place->utime) << name;
    }
    if constexpr (requires { msg.recv_utime; }) {
      EXPECT_EQ(place->recv_utime, msg.recv_utime) << name;
    } else {
      EXPECT_FALSE(place->recv_utime) << name;
    }
  });
  for (const Channel& channel : Channels())
    EXPECT_TRUE(seen.contains(channel.name)) << channel.name;
}

TEST(Channels, TellSendersApartWhereSeveralCount) {
  const auto sender_of = [](const auto& msg) { return PlaceOf(examples::Encoded(msg))->sender; };
  EXPECT_EQ(sender_of(examples::Health()), "mapper");
  EXPECT_EQ(sender_of(examples::GraphRequest()), "optimizer");
  EXPECT_EQ(sender_of(examples::ConfigRequest()), "logger");
  EXPECT_EQ(sender_of(ToLcm(examples::Config(), examples::kTime, 0)[0]), "mapper");
  EXPECT_EQ(sender_of(ToRawParts({}, "can:can0#imu-driver", {}, 0)[0]), "can:can0#imu-driver");
  EXPECT_EQ(sender_of(ToLcm(examples::Imu(), {})), "");
}

TEST(Channels, AreNamedOnceAndTheirTypesDiffer) {
  std::set<std::string> names;
  std::map<std::int64_t, std::string> types;
  for (const Channel& channel : Channels()) {
    EXPECT_TRUE(names.insert(channel.name).second) << channel.name;
    EXPECT_EQ(types.try_emplace(channel.fingerprint, channel.type).first->second, channel.type)
        << "two types have one fingerprint";
  }
}

TEST(Channels, RefuseWhatIsTooShortOrForeign) {
  const std::vector<std::uint8_t> health = examples::Encoded(examples::Health());
  const Channel* channel = FindChannel(channels::kHealth);
  for (std::size_t size = 0; size < health.size(); ++size) {
    const Bytes cut = Bytes(health).first(size);
    EXPECT_FALSE(channel->decodes(cut)) << size;
    EXPECT_EQ(FingerprintOf(cut).has_value(), size >= 8);
    EXPECT_TRUE(size >= 28 || !PlaceOf(cut)) << size;
  }
  std::vector<std::uint8_t> foreign = health;
  foreign[0] ^= 1;
  EXPECT_FALSE(PlaceOf(foreign));
  EXPECT_FALSE(channel->decodes(foreign));
  EXPECT_EQ(FindChannel("FOREIGN"), nullptr);
  EXPECT_EQ(FindChannel(""), nullptr);
}

TEST(Channels, ANumberBelowZeroIsNone) {
  imu_t msg = ToLcm(examples::Imu(), {});
  msg.seq = -1;
  EXPECT_FALSE(PlaceOf(examples::Encoded(msg)));
}

constexpr char kBegin[] = "<!-- channels: made from common/convert/channels.cpp -->\n";
constexpr char kEnd[] = "<!-- /channels -->\n";

std::string Table() {
  std::ostringstream out;
  out << "| channel | type | role | from | to | rate | queue | content |\n"
         "|---|---|---|---|---|---|---:|---|\n";
  for (const Channel& c : Channels()) {
    out << "| `" << c.name << "` | `" << c.type << "` | " << ToString(c.role) << " | " << c.sender
        << " | " << c.receiver << " | " << c.rate << " | "
        << (c.queue == 0 ? "no limit" : std::to_string(c.queue)) << " | " << c.content << " |\n";
  }
  return out.str();
}

// SEASTITCH_UPDATE_DOCS=1 writes the table instead of comparing it.
TEST(Channels, AreTheTableOfTheDocumentation) {
  const auto path = SourceDir() / "docs" / "channels.md";
  const std::string page = TextOf(path);
  const std::size_t begin = page.find(kBegin);
  const std::size_t end = page.find(kEnd);
  ASSERT_TRUE(begin != std::string::npos && end != std::string::npos) << path;
  const std::size_t table_at = begin + sizeof kBegin - 1;
  if (std::getenv("SEASTITCH_UPDATE_DOCS") != nullptr) {
    std::ofstream(path) << page.substr(0, table_at) << Table() << page.substr(end);
    return;
  }
  EXPECT_EQ(page.substr(table_at, end - table_at), Table());
}

}  // namespace
}  // namespace seastitch
