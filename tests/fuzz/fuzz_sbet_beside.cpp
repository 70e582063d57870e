#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "survey/read/sbet_beside.hpp"
#include "tests/fuzz/memory_file.hpp"

// What a survey finds out of the SBET beside it: a week within one of the survey's.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace seastitch;
  const MemoryFile file(data, size);
  const Time survey = FromUtime(1'714'645'230'000'000);
  std::vector<TimedPosition> own;
  for (int i = 0; i < 6; ++i) own.push_back({{1.0, 0.1 + 1e-6 * i}, survey + FromSeconds(5.0 * i)});
  try {
    const SbetParams params = SbetParamsFor(file.path(), survey, own);
    if (std::abs(params.wander_sign) > 1) std::abort();
    if (std::abs(ToSeconds(params.week_start - survey)) > 3.0 * 604'800.0) std::abort();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
