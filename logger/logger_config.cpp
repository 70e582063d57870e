#include "logger/logger_config.hpp"

#include "common/runtime/bus.hpp"
#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {

ParameterTable TableOf(LoggerConfig* config) {
  ParameterTable table;
  DeclareDive(&config->dive, &table);
  table.AddRemoved("file", "logs go into a folder of each dive: name dives_dir");
  const Parameter& channels =
      table.Add("channels",
                &config->channels,
                "Regular expression of the channels to record, matching the whole name. (?!RAW_).* "
                "leaves out the raw bytes of the devices: often more than half of the data, and "
                "needed only to replay a dive through the drivers.");
  table.AddRule(channels, "an LCM channel pattern such as .*", [config] {
    return !config->channels.empty() && Bus::IsPattern(config->channels);
  });
  table.Add(
      "max_queue_mb",
      &config->max_queue_mb,
      Unit::kMegabyte,
      Range::Within(1, 65'536),
      "Size of the queue of messages that wait for the disk. While it is full, new messages "
      "are dropped and counted. 256 MB hold 85 s of data at 3 MB/s. Raise it where HEALTH reports "
      "messages_not_recorded.");
  table.Add("flush_interval_ms",
            &config->flush_interval_ms,
            Unit::kMillisecond,
            Range::Within(1, 60'000),
            "Interval of fsync, which brings the messages to the disk. A power cut loses at most "
            "this much and the duration of an fsync.");
  table.Add("file_max_mb",
            &config->file_max_mb,
            Unit::kMegabyte,
            Range::Within(1, 1'000'000),
            "Size at which a file ends and the next one begins. Files are deleted as a whole.");
  table.Add("file_max_s",
            &config->file_max_s,
            Unit::kSecond,
            Range::Within(1.0, 1e6),
            "Duration after which a file ends and the next one begins.");
  table.Add("dive_max_mb",
            &config->dive_max_mb,
            Unit::kMegabyte,
            Range::Within(0, 2'000'000'000),
            "Maximum size of raw/ and log/ of a dive. Above it the oldest file in raw/ of this "
            "dive is deleted. 0: no limit.");
  table.Add("disk_min_free_mb",
            &config->disk_min_free_mb,
            Unit::kMegabyte,
            Range::Within(0, 2'000'000'000),
            "Free space to keep on the disk. Below it the oldest file in raw/ of all dives is "
            "deleted. 0: no limit.");
  table.Add(
      "delete_logs",
      &config->delete_logs,
      "True: where raw/ has no file left, the oldest file in log/ is deleted instead: of "
      "this dive for dive_max_mb, of all dives for disk_min_free_mb. False: files in log/ are "
      "kept, recording goes on, and HEALTH reports disk_space_low.");
  return table;
}

LoggerConfig LoadLoggerConfig(const std::string& path) {
  LoggerConfig config;
  LoadParameters(path, TableOf(&config));
  ResolveDivesDir(path, &config.dive);
  return config;
}

std::string PrintConfig(const LoggerConfig& config) { return PrintWithDefaults(config, {}); }

}  // namespace seastitch
