#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "common/convert/convert.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {

// Writes the configuration files that processes publish on CONFIG to a dive's config/. mapper.yaml
// is the last one published; mapper.1.yaml, mapper.2.yaml, ... are the versions before. Add() and
// Save() may be called on different threads.
class ConfigArchive {
 public:
  explicit ConfigArchive(std::filesystem::path folder);

  // Adds a message of CONFIG. A name that is not a plain file name is ignored.
  void Add(const LogEvent& event);
  // Writes complete files, with fsync. A failure is counted, and the next call tries again.
  void Save();
  std::int64_t errors() const;

 private:
  void Save(const std::string& name, const std::string& text) const;

  const std::filesystem::path folder_;
  mutable std::mutex mutex_;
  ConfigAssembler assembler_;
  std::map<std::string, std::string> unsaved_;  // text by name
  std::int64_t errors_ = 0;
};

}  // namespace seastitch
