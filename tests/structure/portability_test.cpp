// The same source for x86-64 and arm64: nothing of one processor, and no object read at an address
// that may not suit it. The cross-build of .ci/run shows that it compiles, this that it stays so.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>

#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// What a line of a source has of it, or nothing.
std::string OfOneProcessor(const std::string& line) {
  static const std::regex pattern(
      R"re(<\w*intrin\.h>|<arm_neon\.h>|\b_mm\d*_\w+|__builtin_ia32\w*|\basm\b|__x86_64__|__SSE\w*|__AVX\w*|__rdtsc)re");
  std::smatch match;
  return std::regex_search(line, match, pattern) ? match.str() : "";
}

// A reinterpret_cast to anything but bytes, characters and the socket addresses of the C library.
std::string CastToWiderType(const std::string& line) {
  static const std::regex pattern(
      R"re(reinterpret_cast<(?!(const )?(char|std::uint8_t|unsigned char|sockaddr)\s*\*>)[^;]*)re");
  std::smatch match;
  return std::regex_search(line, match, pattern) ? match.str() : "";
}

// A function of the C library that rounds differently on x86-64 and on arm64
// (common/core/pose.hpp).
std::string RoundedByProcessor(const std::string& line) {
  static const std::regex pattern(R"re(\bstd::(hypot|cbrt|erf|fma)\()re");
  std::smatch match;
  return std::regex_search(line, match, pattern) ? match.str() : "";
}

// Where the library that allocated it vouches for the alignment: FFTW (its complex is that of C++),
// Cairo (rows of pixels of 32 bits).
const std::set<std::string> kAligned{"mapper/registration/correlator.cpp",
                                     "products/report/picture.cpp"};

TEST(Portability, TheChecksSeeWhatTheyLookFor) {
  EXPECT_NE(OfOneProcessor("#include <immintrin.h>"), "");
  EXPECT_NE(OfOneProcessor("  __m128 sum = _mm_add_ps(a, b);"), "");
  EXPECT_EQ(OfOneProcessor("  const double sum = a + b;"), "");
  EXPECT_NE(RoundedByProcessor("  return std::hypot(x, y);"), "");
  EXPECT_EQ(RoundedByProcessor("  return std::sin(x);"), "");
  EXPECT_NE(CastToWiderType("*reinterpret_cast<const std::uint32_t*>(bytes)"), "");
  EXPECT_NE(CastToWiderType("auto* header = reinterpret_cast<Header*>(bytes);"), "");
  EXPECT_EQ(CastToWiderType("reinterpret_cast<const char*>(bytes.data())"), "");
}

TEST(Portability, NothingIsOfOneProcessorOrCastToAWiderType) {
  const fs::path root = SourceDir();
  int files = 0;
  const std::set<std::string> others{"build", "tests", ".git"};
  for (const auto& folder : fs::directory_iterator(root)) {
    if (!folder.is_directory() || others.contains(folder.path().filename().string())) continue;
    for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".hpp") continue;
      ++files;
      const std::string name = fs::relative(entry.path(), root).string();
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        EXPECT_EQ(OfOneProcessor(line), "") << name;
        if (!name.starts_with("bench/")) {
          EXPECT_EQ(RoundedByProcessor(line), "") << name;
        }
        if (kAligned.contains(name)) continue;
        EXPECT_EQ(CastToWiderType(line), "") << name;
      }
    }
  }
  EXPECT_GT(files, 200);
}

}  // namespace
}  // namespace seastitch
