#include "common/runtime/process/restart_counter.hpp"

#include <fstream>

namespace seastitch {

int CountRestart(const std::filesystem::path& runtime_directory) {
  const std::filesystem::path file = runtime_directory / "starts";
  int starts = 0;
  std::ifstream(file) >> starts;
  // Any other content of the file counts as zero starts.
  if (starts < 0 || starts > 1'000'000'000) starts = 0;
  std::ofstream(file, std::ios::trunc) << starts + 1 << '\n';
  return starts;
}

}  // namespace seastitch
