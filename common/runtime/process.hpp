#pragma once

#include <functional>
#include <string>

#include "common/runtime/config.hpp"

namespace seastitch {

// What every process of Seastitch takes on its command line.
struct ProcessArgs {
  std::string config;         // --config FILE
  std::string lcm_url;        // --lcm-url URL; empty: LCM_DEFAULT_URL, else LCM's own default
  bool check_config = false;  // --check-config: read it, say so, leave
};

// Parses the command line, runs `body`, and turns every exception into one line on stderr,
// "NAME: what()", and EXIT_FAILURE. The one main() of each process calls nothing else:
//
//   int main(int argc, char** argv) {
//     return RunProcess(argc, argv, "seastitch-mapper", "…one line…", [](const ProcessArgs& args) {
//       const MapperConfig config = LoadMapperConfig(args.config);
//       if (args.check_config) return EXIT_SUCCESS;
//       …
//       return loop.Run();
//     });
//   }
int RunProcess(int argc,
               char** argv,
               const std::string& name,
               const std::string& description,
               const std::function<int(const ProcessArgs&)>& body);

// Logging: spdlog's default logger on stderr, "2026-01-01T00:00:00.000Z mapper info: ...".
void SetUpLogging(const std::string& process);

}  // namespace seastitch
