#include "survey/replay/replay_config.hpp"

#include <utility>

#include "common/runtime/files/durable_file.hpp"
#include "mapper/mapper_config.hpp"
#include "survey/errors.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// The optimizer's file: the given one, else the one beside the mapper's file, else the shipped one.
fs::path OptimizerFile(const GivenConfig& given) {
  if (!given.optimizer.empty()) return given.optimizer;
  const fs::path beside = given.mapper.parent_path() / "optimizer.yaml";
  const bool there = !given.mapper.empty() && fs::exists(beside);
  return there ? beside : given.shipped_dir / "optimizer.yaml";
}

std::string ChangesIn(const RecordedLogs& recorded) {
  std::string text;
  for (const char* name : {"mapper.yaml", "vehicle.yaml", "optimizer.yaml"})
    if (const auto changed = recorded.Changed(); changed.contains(name))
      text += std::string("; ") + name + " has " + std::to_string(changed.at(name)) +
              " versions in this dive, the last is used";
  return text;
}

// Writes the files to OUT/config, to be read from there.
ReplayConfig Written(const GivenConfig& given,
                     const ConfigTexts& files,
                     const fs::path& out,
                     std::string statement) {
  const fs::path folder = out / "config";
  fs::create_directories(folder);
  for (const auto& [name, text] : files) WriteAtomically(folder / name, text);
  GivenConfig chosen = given;
  chosen.mapper = folder / "mapper.yaml";
  return {chosen.mapper, OptimizerFile(chosen), std::move(statement)};
}

}  // namespace

ReplayConfig ChooseConfig(const GivenConfig& given,
                          const RecordedLogs& recorded,
                          const fs::path& out) {
  const auto files = recorded.Newest();
  const bool is_recorded = files.contains("mapper.yaml") && files.contains("vehicle.yaml");
  if (!given.mapper.empty())
    return {given.mapper,
            OptimizerFile(given),
            given.mapper.filename().string() +
                (is_recorded ? " by --config, in place of the recorded one" : " by --config")};
  if (!is_recorded)
    throw UsageError(recorded.recorders.at(0).at(0).path.string() +
                     ": holds no configuration (channel CONFIG): name the mapper's with --config");
  ConfigTexts texts;
  for (const char* name :
       {"mapper.yaml", "vehicle.yaml", "optimizer.yaml", kWaterLevelFile, kSeparationFile})
    if (files.contains(name)) texts.emplace_back(name, files.at(name).text);
  return Written(given, texts, out, "as recorded" + ChangesIn(recorded));
}

ReplayConfig ChooseConfig(const GivenConfig& given, const FinishedMap& map, const fs::path& out) {
  if (given.mapper.empty()) return Written(given, map.configuration, out, "as the map was made");
  return ChooseConfig(given);
}

DriverFiles ChooseDriverFiles(const GivenConfig& given,
                              const RecordedLogs& recorded,
                              const RawSources& sources,
                              const fs::path& out) {
  const fs::path folder = out / "config";
  fs::create_directories(folder);
  const auto files = recorded.Newest();
  for (const auto& [name, file] : files)
    if (name.ends_with(".dbc") && fs::path(name).filename() == name)
      WriteAtomically(folder / name, file.text);
  const auto choose = [&](const fs::path& by_hand, const std::string& name, const char* option) {
    if (!by_hand.empty()) return by_hand;
    if (!files.contains(name))
      throw UsageError("no " + name + " was recorded: name it with " + option);
    WriteAtomically(folder / name, files.at(name).text);
    return folder / name;
  };
  DriverFiles chosen;
  if (sources.imu) chosen.imu = choose(given.drivers.imu, "imu_driver.yaml", "--imu-config");
  if (sources.dvl) chosen.dvl = choose(given.drivers.dvl, "dvl_driver.yaml", "--dvl-config");
  if (sources.mbes) chosen.mbes = choose(given.drivers.mbes, "mbes_driver.yaml", "--mbes-config");
  if (sources.nav) chosen.nav = choose(given.drivers.nav, "nav_driver.yaml", "--nav-config");
  return chosen;
}

ReplayConfig ChooseConfig(const GivenConfig& given) {
  if (!given.mapper.empty())
    return {given.mapper, OptimizerFile(given), given.mapper.filename().string() + " by --config"};
  return {given.shipped_dir / "mapper.yaml", OptimizerFile(given), "as shipped"};
}

}  // namespace seastitch
