#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace seastitch {

struct QuotaParams {
  std::int64_t max_dive_bytes = 0;              // of a dive's logs; 0: no limit
  std::int64_t min_free_bytes = 1'000'000'000;  // on the disk; 0: no limit
  bool delete_logs = false;                     // where no raw/ is left to delete
};

// Keeps the limits by deleting whole logs: the oldest of raw/ first, then, where it may, the oldest
// of log/. For room on the disk those of earlier dives come first. Never a log that is open.
class Housekeeper {
 public:
  // dive: in the folder of dives.
  Housekeeper(std::filesystem::path dive, const QuotaParams& params);

  // Deletes one log at most, since a disk may take a while to give the room back; to be called
  // again. open: logs that are being written.
  void Tidy(const std::vector<std::filesystem::path>& open);

  std::int64_t files_deleted() const { return files_deleted_; }
  std::int64_t bytes_deleted() const { return bytes_deleted_; }
  // A limit is passed, and there is nothing that may be deleted.
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
