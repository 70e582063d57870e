#include "common/runtime/files/durable_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

namespace seastitch {
namespace {

bool WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

void Write(const std::filesystem::path& path, std::string_view bytes, bool sync) {
  const std::string partial = path.string() + ".partial";
  const auto fail = [&](int error) {
    ::unlink(partial.c_str());
    throw std::runtime_error(path.string() + ": cannot be written: " + std::strerror(error));
  };
  const int fd = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) fail(errno);
  int error = 0;
  if (!WriteAll(fd, bytes) || (sync && ::fsync(fd) != 0)) error = errno;
  if (::close(fd) != 0 && error == 0) error = errno;
  if (error != 0) fail(error);
  if (std::rename(partial.c_str(), path.c_str()) != 0) fail(errno);
}

}  // namespace

void WriteAtomically(const std::filesystem::path& path, std::string_view bytes) {
  Write(path, bytes, false);
}

void WriteDurably(const std::filesystem::path& path, std::string_view bytes) {
  Write(path, bytes, true);
  SyncFolder(std::filesystem::absolute(path).parent_path());
}

void SyncFolder(const std::filesystem::path& folder) {
  const auto fail = [&](int error) {
    throw std::runtime_error(folder.string() + ": " + std::strerror(error));
  };
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) fail(errno);
  const int error = ::fsync(fd) == 0 ? 0 : errno;
  ::close(fd);
  if (error != 0) fail(error);
}

}  // namespace seastitch
