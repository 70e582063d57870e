#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mapper/mapper.hpp"
#include "products/write_products.hpp"
#include "survey/read/raw_replay.hpp"
#include "survey/replay/submap_directory.hpp"

namespace seastitch {

struct ReplayOptions {
  // Folders of dives, LCM logs in any order, survey files; or one directory of submaps (PCD files
  // of the paper's authors). See DivesAmong().
  std::vector<std::filesystem::path> inputs;
  // Map origin (latitude and longitude); absent: that of the first input.
  std::optional<Datum> datum;
  // Configuration files. Empty: the configuration recorded in the logs; for submaps and survey
  // files the files in default_config_dir.
  std::filesystem::path mapper_config;
  std::filesystem::path optimizer_config;
  std::filesystem::path default_config_dir;
  std::filesystem::path out;
  // CSV of water levels (tide): UTC, metres above the map's zero of depth. Empty: that of the
  // configuration, if any.
  std::filesystem::path water_level;
  // Sound speed profile of survey files, in place of any other (ChooseProfiles). Empty: none is
  // given.
  std::filesystem::path profile;
  // Ground truth file of the simulator; absent: LOG.truth.csv if it exists.
  std::optional<std::filesystem::path> truth;
  // Use the recorded map and track of the live processes; do not compute them from the sensor data.
  bool as_recorded = false;
  // No pause and no distance splits survey files into dives (GroupSurveyFiles).
  bool one_dive = false;
  // Do not map again with a calibration that the overlaps of the survey show.
  bool no_calibration = false;
  // Decode the recorded raw bytes again; ignore the recorded messages of the drivers.
  bool from_raw = false;
  // Configuration files of the drivers, with from_raw. Empty: as recorded.
  DriverFiles drivers;
  // Drift of dead reckoning between two submaps of a directory of submaps, 1 sigma [m, deg].
  ImportedDrift drift;
  // Reference system of the map files, such as "EPSG:25832"; empty: the UTM zone of the survey.
  std::string crs;
  double cell_m = 0.0;  // cell of the rasters; 0: chosen from the density of the points
  // If set, all soundings are also exported, in this format.
  std::optional<SoundingFormat> soundings;
  bool quiet = false;
  // The first Ctrl-C ends the reading of the input and makes the map of that part; the second ends
  // the process.
  bool interruptible = false;
  // If set, called with every event of the mapper; the input is then mapped once, as with
  // no_calibration.
  std::function<void(const MapperEvent&)> on_event;
};

// `seastitch replay`: runs mapper and optimizer in one process. It is deterministic: the same input
// gives the same output bytes. The products are written to a temporary folder. When they are
// complete they are moved to `out`: products of an earlier replay are replaced or removed, other
// files stay. Throws std::runtime_error with one line for an input that cannot be used; UsageError
// if the output would overwrite the input, or if a log has no configuration and none is given;
// DataError if no message of a channel has the LCM type of that channel. After any of these `out`
// is unchanged.
ProductSummary RunReplay(const ReplayOptions& options);

// Prints the mapper's configuration to stdout: options.mapper_config, else the defaults.
void PrintReplayConfig(const ReplayOptions& options);

}  // namespace seastitch
