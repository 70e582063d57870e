#include "logger/logger_config.hpp"

#include "common/runtime/bus.hpp"

namespace seastitch {

ParameterTable TableOf(LoggerConfig* config) {
  ParameterTable table;
  DeclareDive(&config->dive, &table);
  table.AddRemoved("file", "logs go into a folder of each dive: name dives_dir");
  const Parameter& channels =
      table.Add("channels",
                &config->channels,
                "LCM pattern of what is recorded; (?!RAW_).* leaves the raw bytes out.");
  table.AddRule(channels, "an LCM channel pattern such as .*", [config] {
    return !config->channels.empty() && Bus::IsPattern(config->channels);
  });
  table.Add("max_queue_mb",
            &config->max_queue_mb,
            Unit::kMegabyte,
            Range::Within(1, 65'536),
            "How far the disk may lag before messages are dropped and counted: 256 are 85 s of 3 "
            "MB/s.");
  table.Add("flush_interval_ms",
            &config->flush_interval_ms,
            Unit::kMillisecond,
            Range::Within(1, 60'000),
            "What a power cut may cost.");
  table.Add("file_max_mb",
            &config->file_max_mb,
            Unit::kMegabyte,
            Range::Within(1, 1'000'000),
            "A log that has reached this size is followed by the next.");
  table.Add("file_max_s",
            &config->file_max_s,
            Unit::kSecond,
            Range::Within(1.0, 1e6),
            "So is one that has lasted this long, by the clock of the logger.");
  table.Add("dive_max_mb",
            &config->dive_max_mb,
            Unit::kMegabyte,
            Range::Within(0, 2'000'000'000),
            "Beyond this the oldest raw bytes of the dive are deleted, whole files; 0: no limit.");
  table.Add("disk_min_free_mb",
            &config->disk_min_free_mb,
            Unit::kMegabyte,
            Range::Within(0, 2'000'000'000),
            "Where less is free the oldest raw bytes of all dives are deleted, whole files; 0: no "
            "limit.");
  table.Add("delete_logs",
            &config->delete_logs,
            "Where no raw bytes are left to delete, the oldest logs follow, of all dives for room "
            "on the disk. Otherwise HEALTH says that there is no room.");
  return table;
}

LoggerConfig LoadLoggerConfig(const std::string& path) {
  LoggerConfig config;
  TableOf(&config).Load(path);
  ResolveDivesDir(path, &config.dive);
  return config;
}

std::string PrintConfig(const LoggerConfig& config) { return PrintWithDefaults(config, {}); }

}  // namespace seastitch
