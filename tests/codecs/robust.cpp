#include <gtest/gtest.h>

#include "tests/codecs/survey_files.hpp"
#include "tests/support/files.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

SurveyContents Read(Bytes file, const MakeReader& make, std::size_t piece_bytes = 65'536) {
  const auto reader = make();
  return ReadSurvey(file, reader.get(), piece_bytes);
}

bool AllSane(const SurveyContents& contents) {
  for (const SurveyRecord& record : contents.records)
    if (const std::string problem = ProblemWith(record); !problem.empty()) {
      ADD_FAILURE() << problem;
      return false;
    }
  return true;
}

ByteVector Damaged(Bytes file) {
  ByteVector bytes(file.begin(), file.end());
  const auto flips = *rc::gen::inRange(0, 8);
  for (int i = 0; i < flips; ++i)
    bytes[*rc::gen::inRange<std::size_t>(0, bytes.size())] = *rc::gen::arbitrary<std::uint8_t>();
  if (*rc::gen::arbitrary<bool>()) {
    const auto from = *rc::gen::inRange<std::size_t>(0, bytes.size());
    const auto n =
        *rc::gen::inRange<std::size_t>(0, std::min<std::size_t>(bytes.size() - from, 300));
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(from);
    bytes.erase(at, at + static_cast<std::ptrdiff_t>(n));
  }
  bytes.resize(*rc::gen::inRange<std::size_t>(0, bytes.size() + 1));
  return bytes;
}

}  // namespace

void ExpectRobust(Bytes file, const MakeReader& make) {
  const SurveyContents whole = Read(file, make);
  ASSERT_FALSE(whole.records.empty());
  EXPECT_TRUE(AllSane(whole));
  const std::string text = TextOf(whole);
  EXPECT_TRUE(rc::check("any pieces give the same records", [&] {
    const auto piece = *rc::gen::inRange<std::size_t>(1, 5000);
    RC_ASSERT(TextOf(Read(file, make, piece)) == text);
  }));
  EXPECT_TRUE(rc::check("damage costs records, not sense, whatever the pieces", [&] {
    const ByteVector damaged = Damaged(file);
    const SurveyContents contents = Read(damaged, make);
    RC_ASSERT(AllSane(contents));
    RC_ASSERT(TextOf(Read(damaged, make, *rc::gen::inRange<std::size_t>(1, 5000))) ==
              TextOf(contents));
  }));
}

}  // namespace seastitch
