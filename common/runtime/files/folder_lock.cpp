#include "common/runtime/files/folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace seastitch {
namespace {

std::string BootId() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  return id;
}

// The text of a lock that another process holds. It may be empty: that process may be about to
// write it.
std::string Holder(const std::filesystem::path& file) {
  std::ifstream in(file);
  const nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("pid") || !json["pid"].is_number_integer())
    return "another process";
  return "process " + std::to_string(json["pid"].get<std::int64_t>());
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "lock";
  const auto fail = [&](const std::string& reason) {
    if (fd_ >= 0) ::close(fd_);
    throw std::runtime_error(folder.string() + ": " + reason);
  };
  fd_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0 && errno == EROFS) {
    fd_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd_ < 0) return;  // a read-only file system: no process can write there
  }
  if (fd_ < 0) fail(std::string("lock cannot be opened: ") + std::strerror(errno));
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) fail(std::string("cannot be locked: ") + std::strerror(errno));
    ::close(fd_);
    throw FolderInUse(folder.string() + ": in use by " + Holder(file) + "; end it first");
  }
  // The text is for people; the lock itself also works on a full disk.
  const std::string text = nlohmann::json{{"pid", ::getpid()}, {"boot_id", BootId()}}.dump() + "\n";
  const bool written = ::ftruncate(fd_, 0) == 0 && ::write(fd_, text.data(), text.size()) > 0;
  static_cast<void>(written);
}

FolderLock::~FolderLock() { ::close(fd_); }

}  // namespace seastitch
