// The command for users: demo, replay, bench, import, info, dive, status, doctor, bug-report,
// reference.

#include <spdlog/spdlog.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/config/config.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/process/freed_memory.hpp"
#include "common/runtime/process/process.hpp"
#include "logger/logger_config.hpp"
#include "products/counted.hpp"
#include "survey/read/message_types.hpp"
#include "survey/replay/interruption.hpp"
#include "survey/replay/replay.hpp"
#include "tools/bench_command.hpp"
#include "tools/command_line.hpp"
#include "tools/configuration.hpp"
#include "tools/demo.hpp"
#include "tools/import.hpp"
#include "tools/info.hpp"
#include "tools/install_paths.hpp"
#include "tools/survey_writer.hpp"
#include "tools/vehicle/bug_report.hpp"
#include "tools/vehicle/doctor.hpp"
#include "tools/vehicle/status.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Adds an example to the end of a command's help.
void Example(CLI::App* command, const std::string& arguments) {
  command->footer("Example:\n  seastitch " + arguments);
}

void ExpectCommand(const CLI::App& app, int argc, char** argv) {
  const std::string word = argc > 1 ? argv[1] : "--help";
  if (!word.starts_with('-') && FindCommand(app, word) == nullptr)
    throw UsageError(UnknownCommand(app, word));
}

// Each Add* function declares one subcommand and the function that it runs; `status` is the exit
// code.

void AddDemo(CLI::App* app, int* status) {
  auto options = std::make_shared<DemoOptions>();
  options->out = "out";
  CLI::App* demo = app->add_subcommand(
      "demo", "simulates a survey with the real processes, then replays its log");
  Example(demo, "demo --out out");
  demo->add_option("--survey", options->survey, "survey description (default: the shipped demo)");
  demo->add_option("--terrain", options->terrain, "seabed from a raster that GDAL reads");
  demo->add_option("--speed", options->speed, "simulated seconds per second")
      ->capture_default_str()
      ->check(AboveZero());
  demo->add_option("--out", options->out, "folder for log, map and report")->capture_default_str();
  demo->callback([options, status] {
    if (options->survey.empty()) options->survey = ConfigDir() / "bench" / "demo.yaml";
    *status = RunDemo(*options);
  });
}

void PrintSummary(const ProductSummary& summary, const fs::path& out) {
  if (summary.outcome == Outcome::kTrackAlone) {
    std::printf("%s\ntrack and report in %s\n", summary.statement.c_str(), out.c_str());
    return;
  }
  std::printf("%s, %llu of %llu soundings used, %s accepted, %llu rejected\n",
              Counted(summary.submaps, "submap").c_str(),
              static_cast<unsigned long long>(summary.soundings_used),
              static_cast<unsigned long long>(summary.soundings_read),
              Counted(summary.loops_accepted, "loop closure").c_str(),
              static_cast<unsigned long long>(summary.loops_rejected));
  if (summary.after().point.cells == 0)
    std::printf("no overlap between submaps: no swath mismatch\n");
  else
    std::printf("swath mismatch RMS %.3f m as navigated, %.3f m in the map\n",
                summary.before.surface.rms_m,
                summary.after().surface.rms_m);
  if (summary.truth) {
    std::printf(
        "position error RMS %.3f m as navigated, %.3f m in the map; heading %.3f deg, %.3f deg\n",
        summary.truth->before.position_rms_m,
        summary.truth->after.position_rms_m,
        summary.truth->before.yaw_rms_deg,
        summary.truth->after.yaw_rms_deg);
  }
  for (const std::string& finding : summary.noise_findings) std::printf("%s\n", finding.c_str());
  for (const std::string& sentence : SentencesOf(summary.dives))
    std::printf("%s\n", sentence.c_str());
  std::printf("%s\nmap and report in %s\n", summary.statement.c_str(), out.c_str());
}

void AddReplay(CLI::App* app, int* status) {
  constexpr int kWarned = 3;
  struct Arguments {
    ReplayOptions replay;
    fs::path truth;
    std::vector<std::string> datum;
    bool print_config = false;
    bool fail_on_warning = false;
  };
  auto arguments = std::make_shared<Arguments>();
  ReplayOptions& options = arguments->replay;
  CLI::App* replay = app->add_subcommand(
      "replay", "makes map, track and report from dives, logs, survey files, maps or submaps");
  Example(replay, "replay /var/lib/seastitch/dives/DIVE_20261122T101500Z --out map");
  CLI::Option* const input = replay->add_option(
      "input",
      options.inputs,
      "folders of dives (or of logs or survey files), maps of earlier replays, LCM logs in any "
      "order, survey files: several dives go into one map; or a directory of submap PCD files");
  CLI::Option* const out = replay->add_option("--out", options.out, "folder of the products");
  replay->add_option(
      "--config",
      options.mapper_config,
      "mapper.yaml, in place of the recorded one (default for submaps and survey files: "
      "the shipped one)");
  replay->add_option(
      "--optimizer-config",
      options.optimizer_config,
      "optimizer.yaml (default: as recorded, beside the mapper's, else the shipped one)");
  replay->add_option(
      "--truth", arguments->truth, "truth file of a simulated survey, for comparison");
  replay->add_flag("--as-recorded",
                   options.as_recorded,
                   "uses the results that the processes recorded, not the sensors' data");
  replay->add_flag("--from-raw",
                   options.from_raw,
                   "decodes the recorded raw bytes again, in place of the drivers' messages");
  replay->add_flag("--no-calibration",
                   options.no_calibration,
                   "does not map again with a calibration that the survey's overlaps show");
  replay->add_flag("--one-dive",
                   options.one_dive,
                   "survey files of a sonar are one dive, whatever time and distance lie between");
  replay->add_option(
      "--imu-config", options.drivers.imu, "imu_driver.yaml for --from-raw (default: as recorded)");
  replay->add_option(
      "--dvl-config", options.drivers.dvl, "dvl_driver.yaml for --from-raw (default: as recorded)");
  replay->add_option("--mbes-config",
                     options.drivers.mbes,
                     "mbes_driver.yaml for --from-raw (default: as recorded)");
  replay->add_option("--water-level",
                     options.water_level,
                     "CSV of UTC and metres of the water line above the map's zero of depth");
  replay
      ->add_option(
          "--profile",
          options.profile,
          "sound speed profile of survey files (.asvp, CARIS .svp, or two columns of metres "
          "and m/s), in place of any other")
      ->check(CLI::ExistingFile);
  replay->add_option(
      "--nav-config", options.drivers.nav, "nav_driver.yaml for --from-raw (default: as recorded)");
  replay
      ->add_option(
          "--drift-xy-m",
          options.drift.sigma_xy_m,
          "for submap files: 1 sigma of the drift between successive submaps, x and y each [m]")
      ->check(AboveZero())
      ->capture_default_str();
  replay->add_option("--drift-yaw-deg", options.drift.sigma_yaw_deg, "the same for yaw [deg]")
      ->check(AboveZero())
      ->capture_default_str();
  replay
      ->add_option("--datum",
                   arguments->datum,
                   "LATITUDE,LONGITUDE of the map's origin in degrees (default: that of the first "
                   "input)")
      ->expected(1, 2);
  replay->add_option("--crs",
                     options.crs,
                     "coordinate reference system of the map files, in metres, such as EPSG:25832 "
                     "(default: the survey's UTM zone on WGS 84)");
  replay
      ->add_option("--cell",
                   options.cell_m,
                   "cell of the rasters [m] (default: twice the spacing of the points, rounded up "
                   "to 1, 2 or 5 times a power of ten)")
      ->check(AboveZero());
  const std::map<std::string, SoundingFormat> formats{{"las", SoundingFormat::kLas},
                                                      {"xyz", SoundingFormat::kXyz}};
  replay
      ->add_option("--soundings",
                   options.soundings,
                   "also writes all corrected soundings to export/soundings.las or .xyz")
      ->transform(CLI::Validator(
          [formats](std::string& text) {
            const auto found = formats.find(CLI::detail::to_lower(text));
            if (found == formats.end()) return "'" + text + "': expected las or xyz";
            text = std::to_string(static_cast<int>(found->second));
            return std::string();
          },
          "las or xyz"));
  replay->add_flag("--quiet", options.quiet, "no progress; warnings are printed");
  replay->add_flag("--fail-on-warning",
                   arguments->fail_on_warning,
                   "exit status 3 if there was a warning; the map is made all the same");
  replay->add_flag(
      "--print-config",
      arguments->print_config,
      "prints the mapper's effective configuration (without --config: the defaults) and "
      "ends");
  replay->callback([arguments, input, out, status] {
    ReplayOptions& chosen = arguments->replay;
    if (arguments->print_config) {
      PrintReplayConfig(chosen);
      *status = EXIT_SUCCESS;
      return;
    }
    for (const CLI::Option* needed : {input, out})
      if (needed->empty()) throw CLI::RequiredError(needed->get_name());
    if (!arguments->truth.empty()) chosen.truth = arguments->truth;
    if (!arguments->datum.empty()) chosen.datum = ParseDatum(arguments->datum);
    chosen.default_config_dir = ConfigDir();
    chosen.interruptible = true;
    const ProductSummary summary = RunReplay(chosen);
    PrintSummary(summary, chosen.out);
    *status = summary.partial                                      ? Interruption::kExitCode
              : arguments->fail_on_warning && summary.warnings > 0 ? kWarned
                                                                   : EXIT_SUCCESS;
  });
}

void AddDive(CLI::App* app, int* status) {
  auto config = std::make_shared<fs::path>();
  CLI::App* dive = app->add_subcommand("dive", "manages the folders of dives");
  dive->require_subcommand(1);
  Example(dive, "dive new --config /etc/seastitch/logger.yaml");
  CLI::App* begin =
      dive->add_subcommand("new", "makes logger and mapper begin a new dive at their next start");
  begin->add_option("--config", *config, "logger.yaml (default: the shipped one)");
  begin->callback([config, status] {
    const fs::path file = config->empty() ? ConfigDir() / "logger.yaml" : *config;
    const auto closed = CloseNewestDive(LoadLoggerConfig(file.string()).dive.dives_dir);
    if (closed)
      std::printf("%s is closed\n", closed->c_str());
    else
      std::printf("no dive was open\n");
    std::printf("a new one begins with: systemctl restart seastitch-logger seastitch-mapper\n");
    *status = EXIT_SUCCESS;
  });
}

void AddStatus(CLI::App* app, int* status) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app->add_subcommand("status", "shows the processes of the vehicle, live");
  Example(command, "status");
  command->add_option("--lcm-url", options->lcm_url, "LCM bus (default: LCM_DEFAULT_URL)");
  command->add_flag("--once", options->once, "prints one table instead of a screen that refreshes");
  command->add_flag("--json", options->json, "prints one JSON object, for programs");
  command->callback([options, status] { *status = RunStatus(*options); });
}

void AddDoctor(CLI::App* app, int* status) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = app->add_subcommand(
      "doctor",
      "checks computer, configuration, processes and sensors before a dive, in at most 10 s; exit "
      "status 0: no findings, 1: warnings, 2: errors");
  command->add_option("--config-dir",
                      options->config_dir,
                      "folder of the processes' configuration (default: /etc/seastitch)");
  command->add_option("--lcm-url", options->lcm_url, "LCM bus (default: LCM_DEFAULT_URL)");
  Example(command, "doctor --under-water");
  command->add_flag("--under-water",
                    options->under_water,
                    "the vehicle is under water: a depth far from 0 is no finding");
  command->add_flag("--json", options->json, "prints JSON, for programs");
  command->callback([options, status] {
    if (options->config_dir.empty()) options->config_dir = ConfigDir();
    *status = RunDoctor(*options);
  });
}

void AddBugReport(CLI::App* app, int* status) {
  auto options = std::make_shared<BugReportOptions>();
  CLI::App* command = app->add_subcommand("bug-report",
                                          "packs versions, configuration, the doctor's findings, "
                                          "the last HEALTH and systemd's journal");
  Example(command, "bug-report --out report.tar.gz");
  command->add_option("--out",
                      options->out,
                      "NAME.tar.gz (default: seastitch-report-TIME.tar.gz in the present folder)");
  command->add_option("--config-dir",
                      options->config_dir,
                      "folder of the processes' configuration (default: /etc/seastitch)");
  command->add_option("--lcm-url", options->lcm_url, "LCM bus (default: LCM_DEFAULT_URL)");
  command->callback([options, status] {
    if (options->config_dir.empty()) options->config_dir = ConfigDir();
    *status = RunBugReport(*options);
  });
}

void AddReference(CLI::App* app, int* status) {
  CLI::App* reference =
      app->add_subcommand("reference", "prints every key of every configuration file, as Markdown");
  Example(reference, "reference > configuration.md");
  reference->callback([status] {
    std::fputs(ConfigurationPage().c_str(), stdout);
    *status = EXIT_SUCCESS;
  });
}

void AddBench(CLI::App* app, int* status) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* bench = app->add_subcommand(
      "bench", "simulates a survey: sends the devices' bytes live, or writes an LCM log");
  Example(bench, "bench --log survey.lcmlog");
  bench->add_option("--survey", options->survey, "survey description (default: the shipped demo)");
  bench->add_option("--terrain", options->terrain, "seabed from a raster that GDAL reads");
  bench->add_option("--config-dir",
                    options->config_dir,
                    "folder of vehicle.yaml and the drivers' files (default: the shipped one)");
  CLI::Option* log = bench->add_option(
      "--log", options->log, "writes an LCM log, and LOG.truth.csv beside it, instead of sending");
  bench->add_flag("--overwrite",
                  options->overwrite,
                  "with --log: also replaces a file that has no truth beside it");
  bench
      ->add_option("--survey-file",
                   options->survey_file,
                   "with --log: the same survey as the .kmall, .all or .s7k of a vehicle whose INS "
                   "navigates")
      ->check([](const std::string& file) {
        return CanWriteSurveyFile(file) ? ""
                                        : file + ": its name must end with .kmall, .all or .s7k";
      })
      ->needs(log);
  bench->add_option("--speed", options->speed, "when sending: simulated seconds per second")
      ->capture_default_str()
      ->check(AboveZero())
      ->excludes(log);
  bench
      ->add_option("--epoch",
                   options->epoch,
                   "when sending: UTC of the survey's start, such as 2026-01-01T00:00:00Z, or now; "
                   "the part of the survey that is in the past is skipped")
      ->excludes(log);
  bench
      ->add_option(
          "--from", options->from_s, "when sending: second of the survey at which to begin")
      ->check(AtLeastZero())
      ->excludes(log);
  bench->add_option("--imu", options->targets.imu, "HOST:PORT of the imu driver, cannelloni")
      ->capture_default_str();
  bench->add_option("--dvl", options->targets.dvl, "HOST:PORT of the dvl driver, cannelloni")
      ->capture_default_str();
  bench->add_option("--mbes", options->targets.mbes, "HOST:PORT of the mbes driver, KMALL")
      ->capture_default_str();
  bench->add_option("--lcm-url",
                    options->targets.lcm_url,
                    "LCM bus for position fixes (default: LCM_DEFAULT_URL, else LCM's own)");
  bench->add_option("--fault",
                    options->faults,
                    "KIND:key=value,... such as dvl_dropout:from_s=300,to_s=330; may be repeated");
  bench->callback([options, status] {
    if (options->survey.empty()) options->survey = ConfigDir() / "bench" / "demo.yaml";
    if (options->config_dir.empty()) options->config_dir = ConfigDir();
    *status = RunBench(*options);
  });
}

void AddImport(CLI::App* app, int* status) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* command = app->add_subcommand(
      "import", "converts survey files and candump logs to an LCM log, with the drivers' decoders");
  Example(command, "import LINE1.kmall LINE2.kmall --log survey.lcmlog");
  command->add_option("file", options->files, "survey files (such as .kmall) and candump logs")
      ->required()
      ->check([](const std::string& file) {
        if (fs::is_directory(file)) return file + " is a folder: name its files";
        return fs::exists(file) ? std::string() : file + ": there is no such file";
      });
  command->add_option("--log", options->log, "LCM log to write; must not exist")->required();
  command->add_option("--imu-config",
                      options->imu_config,
                      "imu_driver.yaml, for candump logs (default: the shipped one)");
  command->add_option("--dvl-config",
                      options->dvl_config,
                      "dvl_driver.yaml, for candump logs (default: the shipped one)");
  command->add_option("--config",
                      options->mapper_config,
                      "mapper.yaml to record in the log if the files contain no navigation");
  command
      ->add_option(
          "--profile",
          options->profile,
          "sound speed profile of survey files (.asvp, CARIS .svp, or two columns of metres "
          "and m/s), in place of any other")
      ->check(CLI::ExistingFile);
  command->add_flag("--one-dive",
                    options->one_dive,
                    "survey files of a sonar are one dive, whatever time and distance lie between");
  command->add_flag("--quiet", options->quiet, "no progress");
  command->callback([options, status] {
    if (options->imu_config.empty()) options->imu_config = ConfigDir() / "imu_driver.yaml";
    if (options->dvl_config.empty()) options->dvl_config = ConfigDir() / "dvl_driver.yaml";
    *status = RunImport(*options);
  });
}

void AddInfo(CLI::App* app, int* status) {
  struct Arguments {
    InfoOptions info;
    fs::path repair_to;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* info = app->add_subcommand(
      "info",
      "lists the content of LCM logs, of a dive, of a map or of survey files, and what is missing");
  Example(info, "info /var/lib/seastitch/dives/DIVE_20261122T101500Z");
  info->add_option("input",
                   arguments->info.inputs,
                   "LCM logs in any order, a dive's folder, the folder of a map, or survey files")
      ->required();
  info->add_flag("--json", arguments->info.json, "prints JSON, for programs");
  info->add_option(
      "--repair", arguments->repair_to, "writes all complete events of one log to this new file");
  info->callback([arguments, status] {
    if (!arguments->repair_to.empty()) arguments->info.repair_to = arguments->repair_to;
    *status = RunInfo(arguments->info);
  });
}

void AddHelp(CLI::App* app, int* status) {
  auto name = std::make_shared<std::string>();
  CLI::App* help = app->add_subcommand("help", "prints the options of a command, with an example");
  Example(help, "help replay");
  help->add_option("command", *name, "such as replay");
  help->callback([app, name, status] {
    const CLI::App* const command = name->empty() ? app : FindCommand(*app, *name);
    if (command == nullptr) throw UsageError(UnknownCommand(*app, *name));
    const std::string typed = name->empty() ? "seastitch" : "seastitch " + *name;
    const auto mode = CLI::AppFormatMode::Normal;
    std::fputs(app->get_formatter()->make_help(command, typed, mode).c_str(), stdout);
    *status = EXIT_SUCCESS;
  });
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  seastitch::KeepFreedMemory();
  // The nodes' log lines are for live processes; a replay has its own output.
  spdlog::set_level(spdlog::level::warn);
  int status = EXIT_FAILURE;
  CLI::App app("Seastitch: makes a depth map in which overlapping swaths agree");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("seastitch ") + seastitch::ProgramVersion());
  seastitch::AddDemo(&app, &status);
  seastitch::AddReplay(&app, &status);
  seastitch::AddReference(&app, &status);
  seastitch::AddDive(&app, &status);
  seastitch::AddStatus(&app, &status);
  seastitch::AddDoctor(&app, &status);
  seastitch::AddBugReport(&app, &status);
  seastitch::AddBench(&app, &status);
  seastitch::AddImport(&app, &status);
  seastitch::AddInfo(&app, &status);
  seastitch::AddHelp(&app, &status);
  seastitch::ExpectCommand(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    throw seastitch::UsageError(seastitch::Explain(app, argc > 1 ? argv[1] : "", e));
  }
  return status;
} catch (const seastitch::UsageError& e) {
  std::fprintf(stderr, "seastitch: %s\n", e.what());
  return EX_USAGE;
} catch (const seastitch::ConfigError& e) {
  std::fprintf(stderr, "seastitch: %s\n", e.what());
  return EX_CONFIG;
} catch (const seastitch::DataError& e) {
  std::fprintf(stderr, "seastitch: %s\n", e.what());
  return EX_DATAERR;
} catch (const seastitch::NoEventError& e) {
  std::fprintf(stderr, "seastitch: %s\n", e.what());
  return EX_DATAERR;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch: %s\n", e.what());
  return EXIT_FAILURE;
}
