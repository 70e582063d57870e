#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "mapper/input/datum_height.hpp"

// A grid of the zero of depth: heights that are numbers, or an error that names the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  try {
    const auto grid =
        DatumHeight::Parse(std::string(reinterpret_cast<const char*>(data), size), "fuzz.asc");
    for (double latitude_rad = -1.5; latitude_rad <= 1.5; latitude_rad += 0.25)
      for (double longitude_rad = -3.1; longitude_rad <= 3.1; longitude_rad += 0.25)
        if (const auto metres = grid.At({latitude_rad, longitude_rad}))
          if (!(std::abs(*metres) <= 10'001.0)) std::abort();
  } catch (const std::runtime_error& e) {
    if (!std::string(e.what()).starts_with("fuzz.asc: ")) std::abort();
  }
  return 0;
}
