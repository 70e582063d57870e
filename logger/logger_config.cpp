#include "logger/logger_config.hpp"

#include <filesystem>

#include "common/runtime/bus.hpp"
#include "common/runtime/config.hpp"

namespace seastitch {
namespace {

// A directory's name is no strftime pattern.
std::string AsPattern(const std::filesystem::path& directory) {
  std::string pattern;
  for (const char c : directory.string()) pattern += c == '%' ? "%%" : std::string(1, c);
  return pattern;
}

}  // namespace

std::string LoggerConfig::Validate() const {
  if (file.empty()) return "file is empty";
  if (channels.empty() || !Bus::IsPattern(channels))
    return "channels = \"" + channels + "\", must be an LCM channel pattern such as \".*\"";
  if (max_queue_mb < 1 || max_queue_mb > 65'536)
    return "max_queue_mb = " + std::to_string(max_queue_mb) + ", must be 1 to 65536";
  if (flush_interval_ms < 1 || flush_interval_ms > 60'000)
    return "flush_interval_ms = " + std::to_string(flush_interval_ms) + ", must be 1 to 60000";
  return "";
}

LoggerConfig LoadLoggerConfig(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  LoggerConfig config;
  root.Read("file", &config.file);
  root.Read("channels", &config.channels);
  root.Read("max_queue_mb", &config.max_queue_mb);
  root.Read("flush_interval_ms", &config.flush_interval_ms);
  root.Finish();
  root.Check(config.Validate());
  if (std::filesystem::path(config.file).is_relative())
    config.file = AsPattern(std::filesystem::absolute(path).parent_path()) + "/" + config.file;
  return config;
}

}  // namespace seastitch
