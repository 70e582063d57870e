#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "mapper/input/water_level.hpp"

// A table of water levels: levels that are numbers, or an error that names a line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  try {
    const auto level =
        WaterLevel::Parse(std::string(reinterpret_cast<const char*>(data), size), "fuzz.csv");
    for (const std::int64_t utime : {std::int64_t{0}, std::int64_t{1'777'716'000'000'000}})
      if (!(std::abs(level.At(FromUtime(utime))) <= 1000.0)) std::abort();
  } catch (const std::runtime_error& e) {
    if (!std::string(e.what()).starts_with("fuzz.csv:")) std::abort();
  }
  return 0;
}
