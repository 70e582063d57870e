#include <spdlog/spdlog.h>

#include <filesystem>
#include <string>
#include <vector>

#include "common/runtime/config/config.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace {

using namespace seastitch;

// A parameter of every kind.
struct Everything {
  bool flag = false;
  int count = 1;
  double length_m = 1.0;
  double angle_rad = 0.5;
  std::vector<double> list{1.0};
  double fraction = 0.5;
  std::string text = "a";
  std::string choice = "one";
  std::filesystem::path dives_dir = "dives";
};

ParameterTable TableOf(Everything* e) {
  ParameterTable table;
  table.Add("flag", &e->flag, "");
  table.Add("count_mb", &e->count, Unit::kMegabyte, Range::Within(1, 100), "");
  table.Add("length_m", &e->length_m, Unit::kMetre, Range::Above(0.0), "");
  table.Add("angle_deg", &e->angle_rad, Unit::kDegreeFromRadian, Range::Within(-180, 180), "");
  table.Add("text", &e->text, "");
  table.AddChoice("choice", &e->choice, {"one", "two"}, "");
  table.Add("dives_dir", &e->dives_dir, "");
  table.AddRemoved("file", "gone");
  // A key that stands in kRenamedKeys.
  table.AddSection("filter", "")
      .Add("min_support_fraction", &e->fraction, Unit::kNone, Range::Above(0.0), "");
  return table;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  spdlog::set_level(spdlog::level::off);  // a renamed key gives a warning
  return 0;
}

// A vehicle.yaml, or a file with a parameter of every kind: read, or refused with a ConfigError.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const MemoryFile file(data + 1, size - 1);
  try {
    if (data[0] % 2 == 0) {
      LoadVehicle(file.path());
    } else {
      Everything everything;
      LoadParameters(file.path(), TableOf(&everything));
    }
  } catch (const ConfigError&) {
  }
  return 0;
}
