// Damage to real files costs the pings that it touches, and no other.
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
#include "codecs/makers/xtf_file.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/paths.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kPieceBytes = 4096;
// More than a ping with all that it is made of.
constexpr std::size_t kLongestBytes = 128 * 1024;

template <class Reader>
std::unique_ptr<SurveyReader> Make() {
  return std::make_unique<Reader>();
}

struct RealFile {
  const char* name;
  std::unique_ptr<SurveyReader> (*make)();
};

// A ping, and the byte of the file before which it was complete.
struct ReadPing {
  std::string text;
  std::size_t end;
};

std::vector<ReadPing> PingsOf(const ByteVector& file, SurveyReader* reader) {
  std::vector<ReadPing> pings;
  const auto add = [&pings](std::vector<SurveyRecord> records, std::size_t end) {
    for (SurveyRecord& record : records) {
      EXPECT_EQ(ProblemWith(record), "");
      if (!std::holds_alternative<MbesPing>(record) && !std::holds_alternative<PlacedPing>(record))
        continue;
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

ByteVector BytesOf(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> chars(std::istreambuf_iterator<char>(in), {});
  return ByteVector(chars.begin(), chars.end());
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

class SurveyMutations : public testing::TestWithParam<RealFile> {};

TEST_P(SurveyMutations, PingsThatDamageDoesNotTouchStayAsTheyAre) {
  constexpr int kDraws = 2;
  const std::filesystem::path path = Shared(std::string("data/mbes/") + GetParam().name);
  SKIP_WITHOUT(path);
  const ByteVector file = BytesOf(path);
  const bool is_gsf = path.extension() == ".gsf";
  const ByteVector foreign =
      BytesOf(Shared(is_gsf ? "data/mbes/em710_g.all" : "data/mbes/gsf_v3_08.gsf"));
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

INSTANTIATE_TEST_SUITE_P(RealFiles,
                         SurveyMutations,
                         testing::Values(RealFile{"em2040_OS01.kmall", Make<KmallFileReader>},
                                         RealFile{"em2040_eg.kmall", Make<KmallFileReader>},
                                         RealFile{"em2040_ac.all", Make<EmAllFileReader>},
                                         RealFile{"em2040c_ay.all", Make<EmAllFileReader>},
                                         RealFile{"em710_g.all", Make<EmAllFileReader>},
                                         RealFile{"gsf_v3_08.gsf", Make<GsfFileReader>},
                                         RealFile{"r2sonic2026.xtf", Make<XtfFileReader>}),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace seastitch
