#pragma once

#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "common/core/submap.hpp"

namespace seastitch {

struct SurveyStoreParams {
  std::filesystem::path directory;
  // Clouds kept in memory, least recently used out first.
  std::int64_t max_cached_mb = 64;
  // Clouds that a bad disk did not take are kept in memory up to here, then the oldest are lost.
  std::int64_t max_unsaved_mb = 128;
};

struct SurveyStoreCounters {
  std::int64_t saved = 0;
  std::int64_t write_errors = 0;
  std::int64_t read_errors = 0;
  std::int64_t lost = 0;  // on no disk and no longer in memory
  std::int64_t cached_bytes = 0;
  std::int64_t unsaved_bytes = 0;
};

// Closed submaps, by id: PCD files and an index in DIRECTORY/UTIME_OF_FIRST_SUBMAP/, so that a dive
// never writes over another. index.jsonl has one line a submap, everything of it but the points,
// appended and synced after its PCD file is in place: what it names is whole. Never throws: a disk
// that fails is counted and the survey goes on from memory. One thread may put while another gets.
class SurveyStore {
 public:
  explicit SurveyStore(const SurveyStoreParams& params) : params_(params) {}

  // After a restart, before the first Put(): these were put, each without points; those whose file
  // is there can be had.
  void Restore(const std::vector<std::shared_ptr<const Submap>>& submaps);
  // Ids count up. One that is there already is refused (false).
  bool Put(std::shared_ptr<const Submap> submap);
  // Null where it was never put, is lost, or its file cannot be read.
  std::shared_ptr<const Submap> Get(SubmapId id);

  SurveyStoreCounters counters() const;
  // Of this dive; empty before the first submap.
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
  mutable std::mutex mutex_;  // of what follows; not held while a submap is written
  std::map<SubmapId, Entry> entries_;
  std::list<SubmapId> recent_;  // cached, most recently used first
  SurveyStoreCounters counters_;
};

}  // namespace seastitch
