#include "common/runtime/process/process.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>

#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {
namespace {

int Fail(const std::string& name, std::string reason, int exit_code) {
  std::replace(reason.begin(), reason.end(), '\n', ' ');
  std::fprintf(stderr, "%s: %s\n", name.c_str(), reason.c_str());
  return exit_code;
}

// The name in logs and in HEALTH: "mapper" for "seastitch-mapper".
std::string ShortName(const std::string& name) {
  constexpr char kPrefix[] = "seastitch-";
  return name.starts_with(kPrefix) ? name.substr(sizeof kPrefix - 1) : name;
}

int RunBody(const ProcessArgs& args,
            const std::string& name,
            const std::function<int(const ProcessArgs&)>& body) {
  SetUpLogging(ShortName(name));
  const int code = body(args);
  if (args.check_config && code == EXIT_SUCCESS)
    std::printf("%s: %s can be used\n", name.c_str(), args.config.c_str());
  return code;
}

}  // namespace

int RunProcess(int argc,
               char** argv,
               const std::string& name,
               const std::string& description,
               const std::function<int(const ProcessArgs&)>& body) {
  ProcessArgs args;
  CLI::App app(description, name);
  CLI::Option* const config = app.add_option("--config", args.config, "configuration file (YAML)");
  app.add_option("--lcm-url", args.lcm_url, "LCM bus (default: LCM_DEFAULT_URL, else LCM's own)");
  app.add_flag("--check-config",
               args.check_config,
               "checks the configuration file and ends; exit status 0 or 78");
  app.add_flag(
      "--print-config",
      args.print_config,
      "prints the effective configuration with comments (without --config: the defaults) and "
      "ends");
  app.set_version_flag("--version", std::string(ProgramVersion()));
  try {
    app.parse(argc, argv);
    if (args.config.empty() && !args.print_config) throw CLI::RequiredError(config->get_name());
    return RunBody(args, name, body);
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    return Fail(name, e.what(), EX_USAGE);
  } catch (const ConfigError& e) {
    return Fail(name, e.what(), EX_CONFIG);
  } catch (const std::exception& e) {
    return Fail(name, e.what(), EXIT_FAILURE);
  }
}

void SetUpLogging(const std::string& process) {
  auto logger =
      std::make_shared<spdlog::logger>(process, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %n %l: %v", spdlog::pattern_time_type::utc);
  spdlog::set_default_logger(std::move(logger));
}

const char* ProgramVersion() { return SEASTITCH_VERSION; }

}  // namespace seastitch
