#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "products/write_products.hpp"
#include "tools/raw_replay.hpp"
#include "tools/submap_directory.hpp"

namespace seastitch {

class Bus;

struct ReplayOptions {
  // Dives' folders, LCM logs in any order, survey files; or one directory of submaps. See
  // DivesAmong().
  std::vector<std::filesystem::path> inputs;
  // Of the map; absent: that of the first input.
  std::optional<Datum> datum;
  // Empty: as recorded in the logs; of submaps and survey files those of default_config_dir.
  std::filesystem::path mapper_config;
  std::filesystem::path optimizer_config;
  std::filesystem::path default_config_dir;
  std::filesystem::path out;
  // Table of water levels; empty: that of the configuration, if any.
  std::filesystem::path water_level;
  // Truth file of the bench; absent: LOG.truth.csv, where there is one.
  std::optional<std::filesystem::path> truth;
  // Map and track as the processes made them at sea, instead of making them anew from the sensors.
  bool as_recorded = false;
  // Decodes the devices' recorded bytes anew, in place of what their drivers made of them.
  bool from_raw = false;
  // The drivers' configurations; empty: as recorded.
  DriverFiles drivers;
  ImportedDrift drift;
  // Every sounding as a file of this format, besides.
  std::optional<SoundingFormat> soundings;
  bool quiet = false;
  // The first Ctrl-C ends the reading, so that there is a map of a part; the second ends the
  // process.
  bool interruptible = false;
  // Called once with the bus of mapper and optimizer, before the first message, to subscribe to it.
  std::function<void(Bus*)> listen;
};

// `seastitch replay`: one process, one order, the same bytes out of the same input. The products
// take the place of `out` when they are whole. Throws std::runtime_error with one line for an input
// that cannot be used; UsageError where the output would go to the input, or a log holds no
// configuration and none is given; DataError where no event of a channel has the type of the
// channel. Then `out` is as it was.
ProductSummary RunReplay(const ReplayOptions& options);

// Writes the mapper's configuration to stdout: that of options.mapper_config, else the defaults.
void PrintReplayConfig(const ReplayOptions& options);

}  // namespace seastitch
