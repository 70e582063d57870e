#include "logger/logger_config.hpp"

#include <filesystem>

#include "common/runtime/bus.hpp"

namespace seastitch {
namespace {

// A directory's name is no strftime pattern.
std::string AsPattern(const std::filesystem::path& directory) {
  std::string pattern;
  for (const char c : directory.string()) pattern += c == '%' ? "%%" : std::string(1, c);
  return pattern;
}

}  // namespace

ParameterTable TableOf(LoggerConfig* config) {
  ParameterTable table;
  const Parameter& file = table.Add(
      "file",
      &config->file,
      "Where the log goes, relative to this file; strftime conversions stand for the start, "
      "UTC. A log that exists is never appended to or replaced: the next one gets a number.");
  table.AddRule(file, "the name of a file", [config] { return !config->file.empty(); });
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
  if (std::filesystem::path(config.file).is_relative())
    config.file = AsPattern(std::filesystem::absolute(path).parent_path()) + "/" + config.file;
  return config;
}

std::string PrintConfig(const LoggerConfig& config) { return PrintWithDefaults(config, {}); }

}  // namespace seastitch
