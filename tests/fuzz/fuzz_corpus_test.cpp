// Gives each fuzzer the inputs of its corpus, as `./run fuzz` does before it makes others.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/paths.hpp"

#define FUZZER(format) extern "C" int fuzz_##format(const std::uint8_t* data, std::size_t size);
#include "fuzzers.inc"
#undef FUZZER

namespace seastitch {
namespace {

struct Fuzzer {
  const char* format;
  int (*run)(const std::uint8_t* data, std::size_t size);
};

#define FUZZER(format) Fuzzer{#format, fuzz_##format},
constexpr Fuzzer kFuzzers[] = {
#include "fuzzers.inc"
};
#undef FUZZER

TEST(FuzzCorpus, EachInputIsReadOrRefused) {
  spdlog::set_level(spdlog::level::off);  // a renamed key gives a warning
  for (const Fuzzer& fuzzer : kFuzzers) {
    int inputs = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(SourceDir() / "tests/fuzz/corpus" / fuzzer.format)) {
      std::ifstream in(entry.path(), std::ios::binary);
      const std::vector<char> bytes(std::istreambuf_iterator<char>(in), {});
      EXPECT_EQ(fuzzer.run(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), 0)
          << entry.path();
      ++inputs;
    }
    EXPECT_GT(inputs, 0) << fuzzer.format;
  }
}

}  // namespace
}  // namespace seastitch
