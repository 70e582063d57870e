#include "survey/replay/replay_input.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/geo/map_frame.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "common/storage/crc32.hpp"
#include "products/product_files.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_config.hpp"
#include "survey/read/message_types.hpp"
#include "survey/replay/output_folder.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// The survey files if all inputs are survey files; nothing if none is.
std::unique_ptr<SurveyFiles> OpenSurvey(const DiveInput& dive, const ReplayOptions& options) {
  const std::vector<fs::path>& inputs = dive.files;
  const auto files = std::count_if(inputs.begin(), inputs.end(), SurveyFiles::IsSurveyFile);
  if (files == 0) return nullptr;
  if (static_cast<std::size_t>(files) < inputs.size())
    throw UsageError("replay: survey files and LCM logs in one folder are not one dive");
  if (options.as_recorded) throw UsageError("replay: --as-recorded needs a log");
  SurveyPlan plan =
      PlanSurvey(inputs, !options.mapper_config.empty(), {options.profile, dive.profiles});
  if (const auto problem = plan.Problem()) throw DataError(*problem);
  return std::make_unique<SurveyFiles>(std::move(plan));
}

// Refuses an output folder that contains an input, or that would replace one.
void ExpectApart(const std::vector<fs::path>& inputs, const fs::path& out) {
  const fs::path target = fs::weakly_canonical(out);
  for (const fs::path& input : inputs) {
    const fs::path source = fs::weakly_canonical(input);
    const fs::path folder = fs::is_directory(input) ? source : source.parent_path();
    const auto [unlike, rest] =
        std::mismatch(folder.begin(), folder.end(), target.begin(), target.end());
    const bool inside = fs::is_directory(input) && unlike == folder.end();
    const bool is_replaced = std::any_of(
        product_files::kFolders.begin(), product_files::kFolders.end(), [&](const char* name) {
          return fs::exists(target / name) && fs::equivalent(folder, target / name);
        });
    if (inside || is_replaced)
      throw UsageError("--out " + out.string() + ": the input " + input.string() +
                       " lies there; choose another folder");
  }
}

// Loads the mapper's configuration. An error in a recorded one of another version is reported as
// such.
MapperConfig LoadChosen(const ReplayConfig& chosen, bool recorded) {
  try {
    return LoadMapperConfig(chosen.mapper.string());
  } catch (const ConfigError& e) {
    if (!recorded) throw;
    throw ConfigError(std::string(e.what()) +
                      ": the recorded configuration is not for this version, --config names "
                      "another");
  }
}

// Error of a folder without an input: names what is in it.
DataError NothingIn(const fs::path& folder) {
  constexpr std::size_t kMostNames = 5;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  std::string found = names.empty() ? "it is empty" : "it holds";
  for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i)
    found += (i == 0 ? " " : ", ") + names[i];
  if (names.size() > kMostNames)
    found += " and " + std::to_string(names.size() - kMostNames) + " more";
  return DataError(folder.string() +
                   ": no logs, no survey files, no map and no submaps (.pcd, .pdc): " + found);
}

GivenConfig GivenBy(const ReplayOptions& options) {
  return {
      options.mapper_config, options.optimizer_config, options.drivers, options.default_config_dir};
}

// The effective configuration, to be stored in the map.
ConfigTexts ConfigurationOf(const Dive& dive) {
  ConfigTexts texts = ConfigFiles(dive.mapper);
  texts.emplace_back("optimizer.yaml", ReadWholeFile(dive.config.optimizer).value_or(""));
  return texts;
}

// A path as a word of a command line.
std::string ForShell(const fs::path& path) {
  std::string word = "'";
  for (const char c : path.string()) word += c == '\'' ? std::string("'\\''") : std::string{c};
  return word + "'";
}

bool IsMap(const DiveInput& dive) {
  return dive.files.empty() && dive.problem.empty() && IsFinishedMap(dive.folder);
}

void ExpectMapsOnce(const std::vector<DiveInput>& dives) {
  std::set<fs::path> maps;
  for (const DiveInput& dive : dives)
    if (IsMap(dive) && !maps.insert(fs::canonical(dive.folder)).second)
      throw UsageError("replay: " + dive.folder.string() + ": given twice");
}

}  // namespace

void ExpectInputs(const ReplayOptions& options) {
  if (options.inputs.empty()) throw UsageError("replay: no input");
  for (const fs::path& input : options.inputs)
    if (!fs::exists(input))
      throw std::runtime_error(input.string() + ": no such file or directory");
  if (options.as_recorded && options.from_raw)
    throw UsageError("replay: either --as-recorded or --from-raw");
  if (options.datum) {
    ProductOptions with_datum;
    with_datum.datum = options.datum;
    if (const std::string wrong = with_datum.Validate(); !wrong.empty())
      throw UsageError("--datum: " + wrong);
  }
  std::vector<fs::path> read = options.inputs;
  for (const fs::path& file :
       {options.mapper_config, options.optimizer_config, options.water_level, options.profile})
    if (!file.empty()) read.push_back(file);
  if (options.truth) read.push_back(*options.truth);
  ExpectApart(read, options.out);
  // An error in a file of all dives is one error, not one of each dive.
  MapperConfig mapper;
  if (!options.mapper_config.empty()) mapper = LoadMapperConfig(options.mapper_config.string());
  if (!options.water_level.empty()) LoadWaterLevel(options.water_level, &mapper);
}

void ExpectDives(const std::vector<DiveInput>& dives, const ReplayOptions& options) {
  const bool submaps = std::any_of(dives.begin(), dives.end(), [](const DiveInput& dive) {
    return dive.files.empty() && HoldsSubmaps(dive.folder);
  });
  if (submaps && dives.size() > 1)
    throw UsageError("replay: a directory of submaps is mapped by itself: it has no map origin");
  const bool maps = std::any_of(dives.begin(), dives.end(), IsMap);
  ExpectMapsOnce(dives);
  if (options.from_raw && dives.size() > 1) throw UsageError("replay: --from-raw takes one dive");
  if (options.as_recorded && (submaps || maps || dives.size() > 1))
    throw UsageError("replay: --as-recorded needs the logs of one dive");
  if (options.soundings && (options.as_recorded || submaps))
    throw UsageError("replay: --soundings needs pings to be placed: no submaps, no --as-recorded");
  if (!options.water_level.empty() && maps)
    throw UsageError(
        "replay: --water-level: the depths of a finished map are what they were; map its dives "
        "again");
  if (options.soundings && maps)
    throw UsageError(
        "replay: --soundings: a finished map holds no single soundings; map its dives "
        "from their own files");
}

Input Open(const DiveInput& dive, const ReplayOptions& options) {
  Input input;
  if (!dive.problem.empty()) throw std::runtime_error(dive.problem);
  if (IsMap(dive)) {
    input.map = ReadFinishedMap(dive.folder, dive.name);
  } else if (dive.files.empty()) {
    if (!HoldsSubmaps(dive.folder)) throw NothingIn(dive.folder);
    input.submaps = ReadSubmapDirectory(dive.folder, options.drift);
  } else if ((input.survey_files = OpenSurvey(dive, options))) {
    for (const fs::path& file : dive.files) input.names.push_back(file.filename().string());
  } else {
    const ChannelRole role = options.as_recorded ? ChannelRole::kResult : ChannelRole::kSensor;
    input.logs = ScanLogs(dive.files, options.quiet);
    if (!options.from_raw) ExpectReadable(input.logs->types, role);
    for (const auto& recorder : input.logs->recorders)
      for (const LogPart& log : recorder) input.names.push_back(log.path.filename().string());
  }
  if (!options.profile.empty() && !input.survey_files)
    throw UsageError(
        "replay: --profile is for survey files; a log has its profiles, or sound_velocity_profile "
        "of mapper.yaml");
  return input;
}

void ExpectOneSurvey(const std::vector<Dive>& dives) {
  struct Place {
    MapFrame frame;
    std::string command;
  };
  std::vector<Place> surveys;
  for (const Dive& dive : dives) {
    if (!dive.input.survey_files || dive.input.survey_files->plan().grid_origin_m) continue;
    const SurveyPlan& plan = dive.input.survey_files->plan();
    const Datum datum = DatumOf(plan.vehicle);
    auto place = std::find_if(surveys.begin(), surveys.end(), [&](const Place& survey) {
      return survey.frame.NorthEastOf(datum).norm() < kLargestMapM;
    });
    if (place == surveys.end()) {
      surveys.push_back({MapFrame(datum), "seastitch replay"});
      place = surveys.end() - 1;
    }
    for (const PlannedFile& file : plan.files) place->command += " " + ForShell(file.path);
  }
  if (surveys.size() < 2) return;
  std::string text = "replay: these are " + std::to_string(surveys.size()) +
                     " surveys, more than " + LargestMapText() + " apart; map each by itself:";
  for (std::size_t i = 0; i < surveys.size(); ++i)
    text += "\n  " + surveys[i].command + " --out map-" + std::to_string(i + 1);
  throw DataError(text);
}

void ExpectNear(const Datum& origin, const std::vector<Dive>& dives) {
  const MapFrame frame(origin);
  for (const Dive& dive : dives) {
    if (!dive.input.survey_files || dive.input.survey_files->plan().grid_origin_m) continue;
    const Datum begin = DatumOf(dive.input.survey_files->plan().vehicle);
    const double away_m = frame.NorthEastOf(begin).norm();
    if (away_m < kLargestMapM) continue;
    const Datum swapped{origin.longitude_deg, origin.latitude_deg};
    const bool is_swapped = std::abs(swapped.latitude_deg) <= 90.0 &&
                            MapFrame(swapped).NorthEastOf(begin).norm() < kLargestMapM;
    char place[60];
    std::snprintf(place, sizeof place, "%.4f,%.4f", begin.latitude_deg, begin.longitude_deg);
    throw UsageError("--datum: " + dive.name + " begins at " + place + ", more than " +
                     LargestMapText() + " from it" + (is_swapped ? ": latitude comes first" : ""));
  }
}

void Prepare(const ReplayOptions& options, const fs::path& out, Dive* dive) {
  const GivenConfig given = GivenBy(options);
  const Input& input = dive->input;
  dive->config = input.logs  ? ChooseConfig(given, *input.logs, out)
                 : input.map ? ChooseConfig(given, *input.map, out)
                             : ChooseConfig(given);
  dive->mapper = LoadChosen(dive->config, options.mapper_config.empty());
  if (!options.water_level.empty()) LoadWaterLevel(options.water_level, &dive->mapper);
  const bool given_vehicle = !options.mapper_config.empty();
  if (input.survey_files) UseSurvey(input.survey_files->plan(), given_vehicle, &dive->mapper);
  if (input.submaps) dive->mapper.mounting = {};  // submaps may be of any vehicle
  if (input.map) {
    dive->mapper.vehicle.datum.latitude_rad = Deg2Rad(input.map->datum.latitude_deg);
    dive->mapper.vehicle.datum.longitude_rad = Deg2Rad(input.map->datum.longitude_deg);
  }
  dive->configuration = ConfigurationOf(*dive);
}

std::uint32_t CrcOfConfiguration(const std::vector<Dive>& dives) {
  std::string text;
  for (const Dive& dive : dives)
    for (const auto& [name, content] : dive.configuration) {
      text += name + "\n";
      std::istringstream lines(content);
      for (std::string line; std::getline(lines, line);)
        if (!line.starts_with("dives_dir:")) text += line + "\n";
    }
  return Crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::unique_ptr<RawReplay> OpenRaw(const ReplayOptions& options,
                                   const Input& input,
                                   const fs::path& out) {
  if (!input.logs) throw UsageError("replay: --from-raw needs a log");
  const RawSources sources(input.logs->senders);
  if (!sources.imu && !sources.dvl && !sources.mbes && !sources.nav)
    throw DataError(input.logs->recorders[0][0].path.string() + ": no raw bytes (RAW_*)");
  return std::make_unique<RawReplay>(
      sources, ChooseDriverFiles(GivenBy(options), *input.logs, sources, out));
}

}  // namespace seastitch
