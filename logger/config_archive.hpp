#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "common/convert/convert.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {

// Writes the files that processes publish on CONFIG into a dive's config/: mapper.yaml as it was
// published last, mapper.1.yaml, mapper.2.yaml, ... as before it changed. Add() and Save() may be
// of different threads.
class ConfigArchive {
 public:
  explicit ConfigArchive(std::filesystem::path folder);

  // A message of CONFIG. Names come from the bus: what is no plain file name is left out.
  void Add(const LogEvent& event);
  // Writes what is whole, to the disk. What fails is counted, and tried again with the next call.
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
