#pragma once

#include <string>

namespace seastitch {

// config/logger.yaml.
struct LoggerConfig {
  // Where the log goes, relative to the YAML file; strftime conversions stand for the start, UTC.
  std::string file = "survey_%Y%m%dT%H%M%SZ.lcmlog";
  std::string channels = ".*";  // LCM pattern of what is recorded
  int max_queue_mb = 256;       // a slow disk may lag by this much: 85 s of the design load, 3 MB/s
  int flush_interval_ms = 100;  // what a power cut may cost
  std::string Validate() const;  // empty if usable
};

// Throws ConfigError.
LoggerConfig LoadLoggerConfig(const std::string& path);

}  // namespace seastitch
