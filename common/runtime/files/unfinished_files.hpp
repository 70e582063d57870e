#pragma once

#include <filesystem>
#include <vector>

namespace seastitch {

// The files that a command is writing. They are deleted if it ends before Keep(): by an exception,
// such as on a full disk, or by Ctrl-C or SIGTERM, which then end the process as they would without
// this class. Files that are there before the command begins are left alone. At most one object at
// a time.
class UnfinishedFiles {
 public:
  explicit UnfinishedFiles(const std::vector<std::filesystem::path>& files);
  ~UnfinishedFiles();
  UnfinishedFiles(const UnfinishedFiles&) = delete;
  UnfinishedFiles& operator=(const UnfinishedFiles&) = delete;

  void Keep();
};

}  // namespace seastitch
