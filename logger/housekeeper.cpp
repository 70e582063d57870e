#include "logger/housekeeper.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <system_error>
#include <utility>

#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/files/durable_file.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// The logs of a folder by number. Symbolic links are skipped: they may point to another disk, where
// deleting frees no space here.
std::map<int, fs::path> LogsIn(const fs::path& folder) {
  std::map<int, fs::path> logs;
  std::error_code error;
  if (fs::is_symlink(folder, error) || fs::is_symlink(folder.parent_path(), error)) return logs;
  for (auto entry = fs::directory_iterator(folder, error); !error && entry != end(entry);
       entry.increment(error)) {
    if (entry->is_symlink(error)) continue;
    if (const auto number = LogNumber(entry->path())) logs[*number] = entry->path();
  }
  return logs;
}

std::int64_t BytesIn(const fs::path& folder) {
  std::int64_t bytes = 0;
  std::error_code error;
  for (const auto& [number, log] : LogsIn(folder)) {
    const auto size = fs::file_size(log, error);
    if (!error) bytes += static_cast<std::int64_t>(size);
  }
  return bytes;
}

}  // namespace

Housekeeper::Housekeeper(fs::path dive, const QuotaParams& params)
    : dive_(std::move(dive)), params_(params) {}

void Housekeeper::Tidy(const std::vector<fs::path>& open) {
  std::optional<fs::path> log;
  const bool dive_too_large = IsDiveTooLarge();
  const bool disk_too_full = IsDiskTooFull();
  if (dive_too_large) log = Oldest({dive_}, open);
  if (!log && disk_too_full) log = Oldest(DivesInOrder(dive_.parent_path()), open);
  const bool deleted = log && Delete(*log);
  short_of_space_ = (dive_too_large || disk_too_full) && !deleted;
}

bool Housekeeper::IsDiveTooLarge() const {
  return params_.max_dive_bytes > 0 &&
         BytesIn(dive_ / "log") + BytesIn(dive_ / "raw") > params_.max_dive_bytes;
}

bool Housekeeper::IsDiskTooFull() const {
  std::error_code unknown;
  const fs::space_info disk = fs::space(dive_, unknown);
  return !unknown && disk.available < static_cast<std::uintmax_t>(params_.min_free_bytes);
}

std::optional<fs::path> Housekeeper::Oldest(const std::vector<fs::path>& dives,
                                            const std::vector<fs::path>& open) const {
  for (const char* part : {"raw", "log"}) {
    if (part == std::string("log") && !params_.delete_logs) break;
    for (const fs::path& dive : dives)
      for (const auto& [number, log] : LogsIn(dive / part))
        if (std::find(open.begin(), open.end(), log) == open.end()) return log;
  }
  return std::nullopt;
}

bool Housekeeper::Delete(const fs::path& log) {
  std::error_code error;
  const auto size = fs::file_size(log, error);
  if (!fs::remove(log, error)) return false;
  ++files_deleted_;
  bytes_deleted_ += static_cast<std::int64_t>(size);
  try {
    SyncFolder(log.parent_path());
  } catch (const std::exception&) {
    // After a power cut the file may exist again; then it is deleted again.
  }
  return true;
}

}  // namespace seastitch
