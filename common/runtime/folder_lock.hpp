#pragma once

#include <filesystem>

namespace seastitch {

// A folder that one process at a time writes to: FOLDER/lock, which holds the process' pid and the
// boot id for people. The kernel drops the lock with the process, however it ends; the file stays.
class FolderLock {
 public:
  // Throws std::runtime_error "FOLDER: in use by process 123 ..." where another holds it.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace seastitch
