#pragma once

#include <string>

#include "common/parameters/parameters.hpp"
#include "common/runtime/files/dive_folder.hpp"

namespace seastitch {

// config/logger.yaml.
struct LoggerConfig {
  DiveParams dive;
  std::string channels = ".*";  // pattern of the channels to record
  int max_queue_mb = 256;       // a slow disk may lag by this much: 85 s of the design load, 3 MB/s
  int flush_interval_ms = 100;  // a power cut loses this much
  int file_max_mb = 1000;       // the next log begins then ...
  double file_max_s = 3600.0;   // ... or then
  int dive_max_mb = 0;          // of its logs; 0: no limit
  int disk_min_free_mb = 1000;  // 0: no limit
  bool delete_logs = false;     // too, where no raw bytes are left to delete
};

// Throws ConfigError.
LoggerConfig LoadLoggerConfig(const std::string& path);
std::string PrintConfig(const LoggerConfig& config);
ParameterTable TableOf(LoggerConfig* config);

}  // namespace seastitch
