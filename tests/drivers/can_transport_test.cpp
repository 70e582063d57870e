#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <string>

#include "drivers/socket/candump.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "tests/drivers/can_generators.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

TEST(Cannelloni, GoldenPacketsDecodeAndComeBackByteForByte) {
  SKIP_WITHOUT(Shared("vectors/cannelloni"));
  for (const auto& vector : ReadJson(Shared("vectors/cannelloni/cannelloni_vectors.json"))) {
    const std::string name = vector["name"];
    const auto bytes = BytesOf(Shared("vectors/cannelloni/" + name + ".bin"));
    ASSERT_EQ(bytes, FromHex(vector["packet"])) << name;
    const auto packet = DecodeCannelloni(bytes);
    ASSERT_TRUE(packet) << name;
    EXPECT_EQ(packet->seq, vector["seq"]);
    ASSERT_EQ(packet->frames.size(), vector["frames"].size());
    for (std::size_t i = 0; i < packet->frames.size(); ++i) {
      const CanFrame& frame = packet->frames[i];
      const auto& expected = vector["frames"][i];
      EXPECT_EQ(IdWord(frame), expected["can_id"]) << name << i;
      EXPECT_EQ(std::vector<std::uint8_t>(frame.data().begin(), frame.data().end()),
                FromHex(expected["data"]));
      EXPECT_EQ(frame.fd, expected.value("fd", false));
      EXPECT_EQ(frame.fd_flags, expected.value("flags", 0));
      if (frame.remote) {
        EXPECT_EQ(frame.length, expected["dlc"]);
      }
    }
    EXPECT_EQ(EncodeCannelloni(packet->frames, packet->seq), bytes) << name;
  }
}

TEST(Cannelloni, AnyFramesComeBackAndEveryTruncationIsRejected) {
  EXPECT_TRUE(rc::check([](const std::vector<CanFrame>& frames, std::uint8_t seq) {
    const std::vector<std::uint8_t> bytes = EncodeCannelloni(frames, seq);
    const auto packet = DecodeCannelloni(bytes);
    RC_ASSERT(packet.has_value());
    RC_ASSERT(packet->seq == seq);
    RC_ASSERT(packet->frames == frames);
    for (std::size_t n = 0; n < bytes.size(); ++n)
      RC_ASSERT(!DecodeCannelloni(Bytes(bytes).first(n)));
  }));
}

TEST(Cannelloni, RejectsOtherVersionsOperationsAndBytesBehindTheEnd) {
  const std::vector<std::uint8_t> good = EncodeCannelloni({}, 7);
  ASSERT_TRUE(DecodeCannelloni(good));
  std::vector<std::uint8_t> bad = good;
  bad[0] = 1;
  EXPECT_FALSE(DecodeCannelloni(bad));
  bad = good;
  bad[1] = 1;
  EXPECT_FALSE(DecodeCannelloni(bad));
  bad = good;
  bad.push_back(0);
  EXPECT_FALSE(DecodeCannelloni(bad));
}

TEST(Cannelloni, RejectsLengthsThatNoBusCarries) {
  const auto packet = [](std::uint8_t length, std::size_t data) {
    std::vector<std::uint8_t> bytes = {2, 0, 0, 0, 1, 0, 0, 1, 0x21, length};
    if ((length & 0x80) != 0) bytes.push_back(0);
    bytes.resize(bytes.size() + data);
    return bytes;
  };
  EXPECT_TRUE(DecodeCannelloni(packet(8, 8)));
  EXPECT_FALSE(DecodeCannelloni(packet(9, 9)));
  EXPECT_TRUE(DecodeCannelloni(packet(0x80 | 64, 64)));
  EXPECT_FALSE(DecodeCannelloni(packet(0x80 | 65, 65)));
}

TEST(Candump, ReadsEveryLineOfTheSample) {
  SKIP_WITHOUT(Shared("vectors/candump"));
  const auto expected = ReadJson(Shared("vectors/candump/sample_candump.json"));
  std::ifstream in(Shared("vectors/candump/sample_candump.log"));
  std::size_t i = 0;
  for (std::string line; std::getline(in, line); ++i) {
    const auto parsed = ParseCandumpLine(line);
    ASSERT_TRUE(parsed) << line;
    const auto& row = expected.at(i);
    EXPECT_EQ(ToUtime(parsed->time), row["t_us"]) << line;
    EXPECT_EQ(parsed->interface, row["iface"]);
    EXPECT_EQ(parsed->frame.id, row["id"]);
    const std::string kind = row["kind"];
    EXPECT_EQ(parsed->frame.error, kind == "error");
    EXPECT_EQ(parsed->frame.remote, kind == "rtr");
    EXPECT_EQ(parsed->frame.fd, kind == "fd");
    if (kind != "error") {
      EXPECT_EQ(parsed->frame.extended, row["extended"]);
    }
    if (kind == "fd") {
      EXPECT_EQ(parsed->frame.fd_flags, row["flags"]);
    }
    if (kind == "rtr") {
      EXPECT_EQ(parsed->frame.length, row.value("dlc", 0));
    }
    EXPECT_EQ(std::vector<std::uint8_t>(parsed->frame.data().begin(), parsed->frame.data().end()),
              FromHex(row["data"]));
    EXPECT_EQ(FormatCandumpLine(*parsed), line);
  }
  EXPECT_EQ(i, expected.size());
  EXPECT_EQ(i, 80u);
}

TEST(Candump, AnyFrameComesBackFromItsLine) {
  EXPECT_TRUE(rc::check([](const CanFrame& frame) {
    const std::int64_t utime = *rc::gen::inRange<std::int64_t>(0, 4'000'000'000'000'000);
    const CandumpLine line{FromUtime(utime), "vcan0", frame};
    const auto parsed = ParseCandumpLine(FormatCandumpLine(line));
    RC_ASSERT(parsed.has_value());
    RC_ASSERT(parsed->time == line.time);
    RC_ASSERT(parsed->interface == "vcan0");
    RC_ASSERT(parsed->frame == frame);
  }));
}

TEST(Candump, TakesAnyNumberOfDigits) {
  for (const auto& [digits, us] : std::map<std::string, std::int64_t>{
           {"2", 200'000}, {"25", 250'000}, {"00200000", 2'000}, {"123456789012345678", 123'456}}) {
    const auto parsed = ParseCandumpLine("(1700000000." + digits + ") can0 121#00");
    ASSERT_TRUE(parsed) << digits;
    EXPECT_EQ(ToUtime(parsed->time), 1700000000'000000 + us) << digits;
  }
}

TEST(Candump, AcceptsNanosecondsDirectionDotsAndLineEnds) {
  const auto parsed = ParseCandumpLine("(1700000000.250000999) can0 121#01.00.06 R\r");
  ASSERT_TRUE(parsed);
  EXPECT_EQ(ToUtime(parsed->time), 1700000000250000);
  EXPECT_EQ(parsed->frame.length, 3);
  EXPECT_EQ(ParseCandumpLine("(1.000000) can0 123#0011223344556677_C")->frame.length, 8);
  EXPECT_EQ(ParseCandumpLine("(1.000000) can0 123##5AA")->frame.fd_flags, 1);
}

TEST(Candump, RefusesWhatIsNoFrame) {
  for (const char* const line : {"",
                                 "# comment",
                                 "(1700000000.250000) can0",
                                 "(1700000000.) can0 121#00",
                                 "(1700000000.1234567890123456789) can0 121#00",
                                 "(1700000000.250000) can0 12#00",
                                 "(1700000000.250000) can0 800#00",
                                 "(1700000000.250000) can0 FFFFFFFF#00",
                                 "(1700000000.250000) can0 121#0",
                                 "(1700000000.250000) can0 121#GG",
                                 "(1700000000.250000) can0 121#001122334455667788",
                                 "(1700000000.250000) can0 121#R9",
                                 "(1700000000.250000) can0 121##0001122334455667788",
                                 "(1700000000.250000) can0 121##",
                                 "(1700000000.250000) can0 121#00. R",
                                 "(1700000000.250000) can0 121#00_9",
                                 "(1700000000.250000) can0 121#00 X",
                                 "(1700000000.250000) can0 121#00 R R",
                                 "(99999999999999999999.250000) can0 121#00",
                                 "(-1.250000) can0 121#00",
                                 "(1700000000.250000 can0 121#00",
                                 "(1700000000.250000) can0 12345#80:00:00000000#00"})
    EXPECT_FALSE(ParseCandumpLine(line)) << line;
}

}  // namespace
}  // namespace seastitch
