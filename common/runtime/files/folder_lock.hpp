#pragma once

#include <filesystem>
#include <stdexcept>

namespace seastitch {

struct FolderInUse : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A folder that one process at a time writes to: FOLDER/lock, which holds the process' pid and the
// boot id for people. The kernel drops the lock with the process, however it ends; the file stays.
class FolderLock {
 public:
  // Throws FolderInUse "FOLDER: in use by process 123 ..." where another holds it, another
  // std::runtime_error where it cannot be locked. On a read-only disk an existing lock file is
  // locked; without one, nothing is.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace seastitch
