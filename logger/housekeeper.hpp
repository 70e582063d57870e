#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace seastitch {

// Limits of disk space; a file is one in raw/ or log/ of a dive's folder.
struct QuotaParams {
  std::int64_t max_dive_bytes = 0;              // of raw/ and log/ of a dive; 0: no limit
  std::int64_t min_free_bytes = 1'000'000'000;  // free space of the disk; 0: no limit
  bool delete_logs = false;                     // true: files in log/ may be deleted, too
};

// Enforces the limits by deleting whole files that are not open. For the limit of the dive: the
// oldest file in its raw/; without one, if delete_logs, the oldest in its log/. For the limit of
// the disk: the oldest file in raw/ of all dives, earlier dives first; without one, if delete_logs,
// the oldest in log/ of all dives.
class Housekeeper {
 public:
  // dive: the folder of the current dive. Its parent has the folders of all dives.
  Housekeeper(std::filesystem::path dive, const QuotaParams& params);

  // Deletes at most one file, because a disk may take a while to free its space. To be called every
  // few seconds. open: files that are being written.
  void Tidy(const std::vector<std::filesystem::path>& open);

  std::int64_t files_deleted() const { return files_deleted_; }
  std::int64_t bytes_deleted() const { return bytes_deleted_; }
  // True: at the last Tidy() a limit was exceeded and no file could be deleted.
  bool short_of_space() const { return short_of_space_; }

 private:
  bool IsDiveTooLarge() const;
  bool IsDiskTooFull() const;
  std::optional<std::filesystem::path> Oldest(const std::vector<std::filesystem::path>& dives,
                                              const std::vector<std::filesystem::path>& open) const;
  bool Delete(const std::filesystem::path& log);

  const std::filesystem::path dive_;
  const QuotaParams params_;
  std::int64_t files_deleted_ = 0;
  std::int64_t bytes_deleted_ = 0;
  bool short_of_space_ = false;
};

}  // namespace seastitch
