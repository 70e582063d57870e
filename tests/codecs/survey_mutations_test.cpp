// Damage to files costs the pings that it touches, and no other. The files are real, but of .s7k,
// of which no real one was ever seen: that is of our own encoder.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "codecs/kongsberg/em_all_file.hpp"
#include "codecs/kongsberg/kmall_file.hpp"
#include "codecs/makers/gsf_file.hpp"
#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_file.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "codecs/makers/xtf_file.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kPieceBytes = 4096;
// More than a ping with all that it is made of.
constexpr std::size_t kLongestBytes = 128 * 1024;

template <class Reader>
std::unique_ptr<SurveyReader> Make() {
  return std::make_unique<Reader>();
}

struct SurveyFile {
  std::string name;  // of a real file, or kOwnS7k
  std::unique_ptr<SurveyReader> (*make)();
  std::string joined_with;  // of a file that the same reader reads
};
constexpr const char* kOwnS7k = "own.s7k";

// A ping, and the byte of the file before which it was complete.
struct ReadPing {
  std::string text;
  std::size_t end;
};

std::vector<ReadPing> PingsOf(const ByteVector& file, SurveyReader* reader, bool numbered = true) {
  std::vector<ReadPing> pings;
  const auto add = [&pings, numbered](std::vector<SurveyRecord> records, std::size_t end) {
    for (SurveyRecord& record : records) {
      EXPECT_EQ(ProblemWith(record), "");
      if (!std::holds_alternative<MbesPing>(record) && !std::holds_alternative<PlacedPing>(record))
        continue;
      if (auto* const placed = std::get_if<PlacedPing>(&record); placed != nullptr && !numbered)
        placed->ping_number = 0;
      SurveyContents one;
      one.records.push_back(std::move(record));
      pings.push_back({TextOf(one), end});
    }
  };
  for (std::size_t at = 0; at < file.size(); at += kPieceBytes) {
    const std::size_t bytes = std::min(kPieceBytes, file.size() - at);
    add(reader->Add(Bytes(file).subspan(at, bytes)), at + bytes);
  }
  add(reader->Finish(), file.size());
  return pings;
}

// 400 pings of 256 beams with position and motion.
ByteVector OwnS7k() {
  ByteVector file;
  const auto add = [&file](const std::vector<std::uint8_t>& record) {
    file.insert(file.end(), record.begin(), record.end());
  };
  SonarInstallation installation;
  installation.time = FromUtime(1'700'000'000'000'000);
  installation.transmitters.resize(1);
  installation.receivers.resize(1);
  add(EncodeS7k7030(installation));
  for (std::uint32_t i = 0; i < 400; ++i) {
    NavigationRecord sample;
    sample.time = installation.time + std::chrono::milliseconds(200 * i);
    sample.position = GeoPosition{1.0 + 1e-8 * i, 0.1};
    sample.attitude = Attitude{};
    add(EncodeS7k1003(sample));
    add(EncodeS7k1016({sample}));
    MbesPing ping;
    ping.time = sample.time;
    ping.ping_number = i;
    ping.sound_speed_mps = 1500.0f;
    ping.beams.resize(256, {0.02f, 0.1f, 0, 0, 0, -20, kBeamValid | kBeamPhase});
    const S7kPingId id{.ping_number = i};
    add(EncodeS7k7000(id, ping.time, 1500.0));
    add(EncodeS7k7027(id, ping));
  }
  return file;
}

std::filesystem::path RealPath(const std::string& name) { return Shared("data/mbes/" + name); }

ByteVector FileBytes(const std::string& name) {
  return name == kOwnS7k ? OwnS7k() : BytesOf(RealPath(name));
}

// A file of another format.
std::string ForeignTo(const std::string& name) {
  return name.ends_with(".gsf") ? "em710_g.all" : "gsf_v3_08.gsf";
}

bool Exists(const std::string& name) {
  return name == kOwnS7k || std::filesystem::exists(RealPath(name));
}

// A file and its damage: the original's bytes from `begin` to `end` are changed or gone.
struct Damaged {
  ByteVector file;
  std::size_t begin, end;
};

enum class Damage { kBit, kHole, kDoubledBlock, kForeignFile, kCut, kCount };

Damaged Draw(Damage damage,
             const ByteVector& file,
             const ByteVector& foreign,
             std::mt19937* random) {
  const std::size_t at = (*random)() % file.size();
  const std::size_t bytes = std::min<std::size_t>(1 + (*random)() % 20'000, file.size() - at);
  const auto place = static_cast<std::ptrdiff_t>(at),
             after = static_cast<std::ptrdiff_t>(at + bytes);
  Damaged damaged{file, at, at};
  switch (damage) {
    case Damage::kBit:
      damaged.file[at] = static_cast<std::uint8_t>(damaged.file[at] ^ (1U << ((*random)() % 8)));
      damaged.end = at + 1;
      break;
    case Damage::kHole:
      damaged.file.erase(damaged.file.begin() + place, damaged.file.begin() + after);
      damaged.end = at + bytes;
      break;
    case Damage::kDoubledBlock:
      damaged.file.insert(damaged.file.begin() + after, file.begin() + place, file.begin() + after);
      damaged.begin = damaged.end = at + bytes;
      break;
    case Damage::kForeignFile:
      damaged.file.insert(damaged.file.begin() + place, foreign.begin(), foreign.end());
      break;
    default: damaged.file.resize(at); damaged.end = file.size();
  }
  return damaged;
}

class SurveyMutations : public testing::TestWithParam<SurveyFile> {
 protected:
  void SetUp() override {
    for (const std::string& name :
         {GetParam().name, GetParam().joined_with, ForeignTo(GetParam().name)})
      if (!Exists(name)) GTEST_SKIP() << "absent: " << RealPath(name);
  }
};

TEST_P(SurveyMutations, PingsThatDamageDoesNotTouchStayAsTheyAre) {
  constexpr int kDraws = 2;
  const ByteVector file = FileBytes(GetParam().name);
  const ByteVector foreign = FileBytes(ForeignTo(GetParam().name));
  const std::vector<ReadPing> whole = PingsOf(file, GetParam().make().get());
  ASSERT_FALSE(whole.empty());
  std::mt19937 random(1);
  for (int damage = 0; damage < static_cast<int>(Damage::kCount); ++damage)
    for (int draw = 0; draw < kDraws; ++draw) {
      const Damaged damaged = Draw(static_cast<Damage>(damage), file, foreign, &random);
      std::multiset<std::string> left;
      for (ReadPing& ping : PingsOf(damaged.file, GetParam().make().get()))
        left.insert(std::move(ping.text));
      int untouched = 0, lost = 0;
      for (const ReadPing& ping : whole) {
        if (ping.end > damaged.begin && ping.end < damaged.end + kLongestBytes) continue;
        ++untouched;
        const auto found = left.find(ping.text);
        if (found == left.end())
          ++lost;
        else
          left.erase(found);
      }
      EXPECT_EQ(lost, 0) << "of " << untouched << "; kind " << damage << ", bytes " << damaged.begin
                         << " to " << damaged.end << " of " << file.size();
    }
}

// Without their numbers: the reader of GSF numbers them itself.
TEST_P(SurveyMutations, JoinedFilesGiveThePingsOfBoth) {
  ByteVector joined = FileBytes(GetParam().name);
  const ByteVector other = FileBytes(GetParam().joined_with);
  std::multiset<std::string> expected, read;
  for (const ByteVector& file : {joined, other})
    for (ReadPing& ping : PingsOf(file, GetParam().make().get(), false))
      expected.insert(std::move(ping.text));
  joined.insert(joined.end(), other.begin(), other.end());
  for (ReadPing& ping : PingsOf(joined, GetParam().make().get(), false))
    read.insert(std::move(ping.text));
  EXPECT_EQ(read.size(), expected.size());
  EXPECT_TRUE(read == expected);
}

INSTANTIATE_TEST_SUITE_P(
    Files,
    SurveyMutations,
    testing::Values(SurveyFile{"em2040_OS01.kmall", Make<KmallFileReader>, "em2040_eg.kmall"},
                    SurveyFile{"em2040_eg.kmall", Make<KmallFileReader>, "em2040_OS01.kmall"},
                    SurveyFile{"em2040_ac.all", Make<EmAllFileReader>, "em2040c_ay.all"},
                    SurveyFile{"em2040c_ay.all", Make<EmAllFileReader>, "em710_g.all"},
                    SurveyFile{"em710_g.all", Make<EmAllFileReader>, "em2040_ac.all"},
                    SurveyFile{"gsf_v3_08.gsf", Make<GsfFileReader>, "gsf_v3_08.gsf"},
                    SurveyFile{"r2sonic2026.xtf", Make<XtfFileReader>, "r2sonic2026.xtf"},
                    SurveyFile{kOwnS7k, Make<S7kFileReader>, kOwnS7k}),
    [](const auto& test) {
      std::string name = test.param.name;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

}  // namespace
}  // namespace seastitch
