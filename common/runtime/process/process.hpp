#pragma once

#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>

#include "common/runtime/config/config.hpp"

namespace seastitch {

// Version of this build, such as "0.1.0".
const char* ProgramVersion();

// Command-line options that every process of Seastitch has.
struct ProcessArgs {
  std::string config;         // --config FILE
  std::string lcm_url;        // --lcm-url URL; empty: LCM_DEFAULT_URL, else LCM's own default
  bool check_config = false;  // --check-config: validate the file, print the result, exit
  bool print_config = false;  // --print-config: print it (without FILE the defaults), exit
};

// Loads the configuration named on the command line. Absent after --check-config and
// --print-config, which are carried out here: the process has to end. check: additional tests of
// the machine; throws ConfigError. check runs only with --check-config. A process that starts
// normally skips it: it waits for a missing device.
template <class Config>
std::optional<Config> LoadConfig(
    const ProcessArgs& args,
    Config (*load)(const std::string& path),
    const std::type_identity_t<std::function<void(const Config&)>>& check = {}) {
  const Config config = args.config.empty() ? Config{} : load(args.config);
  if (args.check_config && check) check(config);
  if (args.print_config) std::fputs(PrintConfig(config).c_str(), stdout);
  if (args.print_config || args.check_config) return std::nullopt;
  return config;
}

// Parses the command line, runs `body`, and turns every exception into one line on stderr,
// "NAME: what()", and an exit status of sysexits.h: 64 (EX_USAGE) for the command line, 78
// (EX_CONFIG) for a ConfigError, 1 for everything else. systemd restarts after the last only. The
// one main() of each process calls nothing else:
//
//   int main(int argc, char** argv) {
//     return RunProcess(argc, argv, "seastitch-mapper", "…one line…", [](const ProcessArgs& args) {
//       const auto config = LoadConfig(args, LoadMapperConfig);
//       if (!config) return EXIT_SUCCESS;
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
