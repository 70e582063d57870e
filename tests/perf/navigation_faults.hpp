#pragma once

#include <filesystem>
#include <string>

namespace seastitch::test {

struct FaultOptions {
  std::string only;                                    // part of a case's name
  int simulated = 3;                                   // dives
  std::filesystem::path akit = "../shared/data/akit";  // left out where absent
  bool counters = false;
};

// Prints a table: a line for each case and dive, and whether the goal is met.
void PrintFaults(const FaultOptions& options);

}  // namespace seastitch::test
