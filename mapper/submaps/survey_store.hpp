#pragma once

#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "common/core/health/counters.hpp"
#include "common/core/submap.hpp"
#include "common/storage/submap_file.hpp"

namespace seastitch {

// Name of the file with a submap's points.
std::string SubmapFileName(SubmapId id);

struct SurveyStoreParams {
  std::filesystem::path directory;
  // Limit of the clouds kept in memory; the least recently used are dropped first.
  std::int64_t max_cached_mb = 64;
  // Limit of the clouds that could not be written and are kept in memory; beyond it the oldest are
  // lost.
  std::int64_t max_unsaved_mb = 128;
  // kMayLoseFile for a replay, which can begin again and need not wait for the disk.
  PowerCut power_cut = PowerCut::kLeavesFile;
};

struct SurveyStoreCounters {
  std::int64_t saved = 0;
  std::int64_t write_errors = 0;
  std::int64_t read_errors = 0;
  std::int64_t lost = 0;     // neither on the disk nor in memory
  std::int64_t missing = 0;  // found without a file at the restart
  std::int64_t cached_bytes = 0;
  std::int64_t unsaved_bytes = 0;

  Counters ByName() const;  // store_saved, ...
  // The submaps without points and why, for people; empty: all have theirs. not_stored: those that
  // never came to the store, because the disk did not respond.
  std::string PointsLost(std::int64_t not_stored = 0) const;
};

// Store of closed submaps by id: PCD files and an index in DIRECTORY/UTIME_OF_FIRST_SUBMAP/, so
// that a dive never overwrites another. index.jsonl has one line per submap with everything except
// the points. It is appended and flushed after the PCD file is in place, so that every file in it
// is complete. A submap is saved when its files and their folder are flushed to the disk, unless a
// power cut may lose them. Never
// throws: errors of the disk are counted, and the survey continues in memory. One thread may call
// Put() while another calls Get().
class SurveyStore {
 public:
  explicit SurveyStore(const SurveyStoreParams& params) : params_(params) {}
  // Makes the folder params.directory, which Put() otherwise does when it is needed. Throws
  // std::runtime_error.
  static void MakeDirectory(const std::filesystem::path& directory);

  // After a restart, before the first Put(): the submaps that were stored, without points. Those
  // with a file can be read with Get().
  void Restore(const std::vector<std::shared_ptr<const Submap>>& submaps);
  // Ids must increase. False if the id exists already.
  bool Put(std::shared_ptr<const Submap> submap);
  // Null if it was never stored, is lost, or its file cannot be read.
  std::shared_ptr<const Submap> Get(SubmapId id);

  SurveyStoreCounters counters() const;
  // Folder of this dive; empty before the first submap.
  const std::filesystem::path& directory() const { return dive_; }

 private:
  struct Entry {
    Submap without_points;
    bool saved = false;
    std::shared_ptr<const Submap> cached;  // null: on disk only
    std::int64_t bytes = 0;
    std::list<SubmapId>::iterator place;  // in recent_, while cached
  };

  bool Save(const Submap& submap, bool first);
  bool AppendToIndex(const Submap& submap);
  std::filesystem::path PcdPath(SubmapId id) const;
  void Cache(SubmapId id, std::shared_ptr<const Submap> submap);
  void Drop(SubmapId id);
  void Evict();

  const SurveyStoreParams params_;
  std::filesystem::path dive_;
  mutable std::mutex mutex_;  // guards the members below; not locked while a submap is written
  std::map<SubmapId, Entry> entries_;
  std::list<SubmapId> recent_;  // cached, most recently used first
  SurveyStoreCounters counters_;
};

}  // namespace seastitch
