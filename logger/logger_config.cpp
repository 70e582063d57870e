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
