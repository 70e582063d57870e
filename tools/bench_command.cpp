#include "tools/bench_command.hpp"

#include <cstdio>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <sstream>

#include "bench/log.hpp"
#include "bench/path.hpp"
#include "bench/survey_config.hpp"
#include "common/convert/convert.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "common/runtime/files/unfinished_files.hpp"
#include "common/runtime/health.hpp"
#include "mapper/mapper_config.hpp"
#include "survey/progress.hpp"
#include "survey/read/message_types.hpp"
#include "tools/survey_writer.hpp"

namespace seastitch {
namespace {

Time EpochOf(const std::string& text) {
  if (text == "now") return FromUtime(NowUtime());
  std::tm utc{};
  std::istringstream in(text);
  in >> std::get_time(&utc, "%Y-%m-%dT%H:%M:%SZ");
  if (!in || in.peek() != std::istringstream::traits_type::eof())
    throw UsageError("--epoch: '" + text + "': expected a UTC time, such as 2026-01-01T00:00:00Z");
  return FromUtime(std::int64_t{timegm(&utc)} * 1'000'000);
}

}  // namespace

std::filesystem::path MapperConfigFor(const bench::SurveyConfig& survey,
                                      const std::filesystem::path& config_dir) {
  const std::filesystem::path of_class = config_dir / ("mapper_" + survey.error_class + ".yaml");
  const bool fits = survey.errors == bench::SensorErrors::OfClass(survey.error_class) &&
                    std::filesystem::exists(of_class);
  return fits ? of_class : config_dir / "mapper.yaml";
}

MapperConfig LoadMapperConfigFor(const bench::SurveyConfig& survey,
                                 const std::filesystem::path& config_dir) {
  MapperConfig config = LoadMapperConfig(MapperConfigFor(survey, config_dir).string());
  config.navigation.start_at_first_fix = survey.fixes.gps;
  if (survey.fixes.gps) return config;
  const Eigen::Vector2d start = bench::Path(survey.plan).At(0.0).p;
  config.navigation.start_north_m = start.x();
  config.navigation.start_east_m = start.y();
  return config;
}

std::filesystem::path WriteMapperConfigFor(const bench::SurveyConfig& survey,
                                           const std::filesystem::path& config_dir,
                                           const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "mapper.yaml";
  std::ofstream(file) << PrintConfig(LoadMapperConfigFor(survey, config_dir));
  return file;
}

bench::SurveySimulator MakeSimulator(const BenchOptions& options) {
  bench::SurveyConfig survey = bench::LoadSurvey(options.survey.string());
  if (!options.terrain.empty()) survey.raster.file = options.terrain.string();
  if (!options.epoch.empty()) survey.start = EpochOf(options.epoch);
  for (const std::string& fault : options.faults) {
    survey.faults.push_back(bench::ParseFault(fault));
  }
  std::fprintf(stderr,
               "survey %s, seed %llu\n",
               options.survey.filename().c_str(),
               static_cast<unsigned long long>(survey.seed));
  return bench::SurveySimulator(survey,
                                LoadVehicle((options.config_dir / "vehicle.yaml").string()),
                                bench::LoadDriverConfigs(options.config_dir).signals());
}

namespace {

// The configuration messages that the processes of the simulated vehicle would publish.
std::vector<config_t> ConfigurationOf(const MapperConfig& mapper,
                                      const bench::DriverConfigs& drivers) {
  std::vector<config_t> all = ConfigParts("mapper", ConfigFiles(mapper));
  for (const auto& parts :
       {ConfigParts("imu-driver", ConfigFiles(drivers.imu)),
        ConfigParts("dvl-driver", ConfigFiles(drivers.dvl)),
        ConfigParts("mbes-driver", {{"mbes_driver.yaml", PrintConfig(drivers.mbes)}})})
    all.insert(all.end(), parts.begin(), parts.end());
  return all;
}

}  // namespace

int RunBench(const BenchOptions& options) {
  const std::filesystem::path truth = options.log.string() + ".truth.csv";
  if (!options.overwrite && std::filesystem::exists(options.log) && !std::filesystem::exists(truth))
    throw UsageError(options.log.string() + ": exists, and no bench made it (" +
                     truth.filename().string() +
                     " is not beside it): name another file, or give --overwrite");
  bench::SurveySimulator simulator = MakeSimulator(options);
  ProgressLine progress("simulating", 1000, false);
  const auto show = [&](double part) {
    progress.Set(static_cast<std::uint64_t>(1000.0 * part));
    return true;
  };
  if (options.log.empty()) {
    const bench::LiveResult sent =
        bench::SendLive(&simulator,
                        options.targets,
                        options.speed,
                        show,
                        {.survey_s = options.from_s, .now = !options.epoch.empty()});
    progress.Finish();
    std::printf("%lld packets sent, %lld refused, at most %.3f s late\n",
                static_cast<long long>(sent.packets),
                static_cast<long long>(sent.refused),
                sent.max_lag_s);
  } else {
    // A log of an earlier bench goes first, so that none is left beside another one's truth.
    for (const std::filesystem::path& old : {options.log, truth}) std::filesystem::remove(old);
    UnfinishedFiles unfinished({options.log, truth, options.survey_file});
    const bench::SurveyConfig survey = bench::LoadSurvey(options.survey.string());
    const std::filesystem::path mapper = MapperConfigFor(survey, options.config_dir);
    const bench::DriverConfigs drivers = bench::LoadDriverConfigs(options.config_dir);
    const MapperConfig mapper_config = LoadMapperConfigFor(survey, options.config_dir);
    const bench::LogResult written = bench::WriteLog(
        &simulator, drivers, ConfigurationOf(mapper_config, drivers), options.log, show);
    progress.Finish();
    std::printf("%lld events in %s, with the configuration %s\n",
                static_cast<long long>(written.events),
                options.log.c_str(),
                mapper.c_str());
    if (!options.survey_file.empty()) {
      const SurveyWriterResult file =
          WriteSurveyFile({options.log, mapper_config, options.survey_file});
      std::printf("%lld pings, %lld positions and %lld jumps of the INS in %s\n",
                  static_cast<long long>(file.pings),
                  static_cast<long long>(file.positions),
                  static_cast<long long>(file.fixes),
                  options.survey_file.c_str());
    }
    unfinished.Keep();
  }
  std::printf("%lld pings, %lld soundings\n",
              static_cast<long long>(simulator.counts().pings),
              static_cast<long long>(simulator.counts().soundings));
  return EXIT_SUCCESS;
}

}  // namespace seastitch
