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
                "LCM pattern of the channels that are recorded. (?!RAW_).* leaves the raw bytes "
                "out.");
  table.AddRule(channels, "an LCM channel pattern such as .*", [config] {
    return !config->channels.empty() && Bus::IsPattern(config->channels);
  });
  table.Add("max_queue_mb",
            &config->max_queue_mb,
            Unit::kMegabyte,
            Range::Within(1, 65'536),
            "Messages that may wait for the disk before new ones are dropped and counted. 256 "
            "are 85 s of 3 MB/s.");
  table.Add("flush_interval_ms",
            &config->flush_interval_ms,
            Unit::kMillisecond,
            Range::Within(1, 60'000),
            "Interval at which messages are written through to the disk. A power cut costs at "
            "most this much.");
  table.Add("file_max_mb",
            &config->file_max_mb,
            Unit::kMegabyte,
            Range::Within(1, 1'000'000),
            "Size at which a log ends and the next one begins.");
  table.Add("file_max_s",
            &config->file_max_s,
            Unit::kSecond,
            Range::Within(1.0, 1e6),
            "Duration after which a log ends and the next one begins, by the logger's clock.");
  table.Add("dive_max_mb",
            &config->dive_max_mb,
            Unit::kMegabyte,
            Range::Within(0, 2'000'000'000),
            "Most that a dive may occupy. Beyond it the oldest raw bytes of the dive are "
            "deleted, whole files. 0: no limit.");
  table.Add("disk_min_free_mb",
            &config->disk_min_free_mb,
            Unit::kMegabyte,
            Range::Within(0, 2'000'000'000),
            "Free room to keep on the disk. Below it the oldest raw bytes of all dives are "
            "deleted, whole files. 0: no limit.");
  table.Add("delete_logs",
            &config->delete_logs,
            "True: the oldest logs may be deleted too where no raw bytes are left, of all "
            "dives for room on the disk. False: they are kept, and HEALTH reports the lack of "
            "room.");
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
