#pragma once

#include <string>

#include "common/runtime/dive_folder.hpp"
#include "common/runtime/parameters.hpp"

namespace seastitch {

// config/logger.yaml.
struct LoggerConfig {
  DiveParams dive;
  std::string channels = ".*";  // LCM pattern of what is recorded
  int max_queue_mb = 256;       // a slow disk may lag by this much: 85 s of the design load, 3 MB/s
  int flush_interval_ms = 100;  // what a power cut may cost
};

// Throws ConfigError.
LoggerConfig LoadLoggerConfig(const std::string& path);
std::string PrintConfig(const LoggerConfig& config);
ParameterTable TableOf(LoggerConfig* config);

}  // namespace seastitch
