#include "mapper/submaps/survey_store.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "common/storage/submap_file.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kMegabyte = 1'000'000;

std::int64_t BytesOf(const Submap& submap) {
  constexpr std::size_t kPerPoint = sizeof(Eigen::Vector3f) + sizeof(float);
  return static_cast<std::int64_t>(sizeof(Submap) + submap.cloud.size() * kPerPoint +
                                   submap.footprint.size() * sizeof(Eigen::Vector2d));
}

Submap WithoutPoints(const Submap& submap) {
  Submap copy = submap;
  copy.cloud = {};
  return copy;
}

template <class Matrix>
nlohmann::json ByRows(const Matrix& m) {
  nlohmann::json values = nlohmann::json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) values.push_back(m(r, c));
  }
  return values;
}

template <class T, class ToJson>
nlohmann::json OrNull(const std::optional<T>& value, ToJson to_json) {
  return value ? nlohmann::json(to_json(*value)) : nlohmann::json();
}

// A submap's record without its points. Doubles are written exactly.
std::string IndexLine(const Submap& submap, const std::string& file) {
  const Eigen::Quaterniond q(submap.T_map_submap.linear());
  nlohmann::json footprint = nlohmann::json::array();
  for (const Eigen::Vector2d& corner : submap.footprint) {
    footprint.push_back({corner.x(), corner.y()});
  }
  const nlohmann::json line = {
      {"id", submap.id.value},
      {"file", file},
      {"points", submap.cloud.size()},
      {"start_utime", ToUtime(submap.start)},
      {"end_utime", ToUtime(submap.end)},
      {"frame_utime", ToUtime(submap.frame_time)},
      {"p_map_submap_m", ByRows(submap.T_map_submap.translation())},
      {"q_map_submap_wxyz", {q.w(), q.x(), q.y(), q.z()}},
      {"covariance_from_previous",
       OrNull(submap.covariance_from_previous, ByRows<Eigen::Matrix3d>)},
      {"heading_sigma_rad", OrNull(submap.heading_sigma_rad, [](double sigma) { return sigma; })},
      {"trigger", ToString(submap.trigger)},
      {"predicted_information", OrNull(submap.predicted_information, ByRows<Eigen::Matrix3d>)},
      {"soundings_read", submap.soundings_read},
      {"soundings_used", submap.soundings_used},
      {"footprint_m", footprint},
  };
  return line.dump() + "\n";
}

// Appends the text. On failure nothing of it remains.
bool Append(const std::filesystem::path& path, const std::string& text, PowerCut power_cut) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (fd < 0) return false;
  const off_t before = ::lseek(fd, 0, SEEK_END);
  const ssize_t written = ::write(fd, text.data(), text.size());
  const bool whole = written == static_cast<ssize_t>(text.size()) &&
                     (power_cut == PowerCut::kMayLoseFile || ::fsync(fd) == 0);
  // An incomplete line would make the next one unreadable. If the disk refuses this too, the reader
  // has to skip it.
  const bool mended = whole || before < 0 || ::ftruncate(fd, before) == 0;
  return ::close(fd) == 0 && whole && mended;
}

// Removes an incomplete last line, left when a process ended: it would make the next one
// unreadable.
void EndAtWholeLine(const std::filesystem::path& path) {
  const std::string text = ReadWholeFile(path).value_or("");
  if (text.empty() || text.back() == '\n') return;
  std::error_code ignored;
  std::filesystem::resize_file(path, text.rfind('\n') + 1, ignored);
}

}  // namespace

bool SurveyStore::Put(std::shared_ptr<const Submap> submap) {
  const SubmapId id = submap->id;
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    if (entries_.contains(id)) return false;
    first = entries_.empty();
    if (dive_.empty()) dive_ = params_.directory / std::to_string(ToUtime(submap->start));
  }
  const bool saved = Save(*submap, first);
  const std::lock_guard lock(mutex_);
  ++(saved ? counters_.saved : counters_.write_errors);
  Entry& entry = entries_[id];
  entry.without_points = WithoutPoints(*submap);
  entry.saved = saved;
  entry.bytes = BytesOf(*submap);
  Cache(id, std::move(submap));
  return true;
}

void SurveyStore::Restore(const std::vector<std::shared_ptr<const Submap>>& submaps) {
  // As Put() names it: frames for fixes, which have no soundings, are not stored.
  const auto first = std::find_if(submaps.begin(), submaps.end(), [](const auto& submap) {
    return HasSoundings(submap->trigger);
  });
  if (first == submaps.end()) return;
  const std::lock_guard lock(mutex_);
  dive_ = params_.directory / std::to_string(ToUtime((*first)->start));
  for (const auto& submap : submaps) {
    if (!HasSoundings(submap->trigger)) continue;
    const std::filesystem::path file = PcdPath(submap->id);
    std::error_code error;
    Entry& entry = entries_[submap->id];
    entry.without_points = *submap;
    entry.saved = std::filesystem::is_regular_file(file, error);
    if (!entry.saved) ++counters_.missing;
    entry.bytes = entry.saved ? static_cast<std::int64_t>(std::filesystem::file_size(file, error))
                              : BytesOf(*submap);
  }
  EndAtWholeLine(dive_ / kSubmapIndex);
}

std::string SubmapFileName(SubmapId id) {
  char name[32];
  std::snprintf(name, sizeof name, "submap_%06d.pcd", id.value);
  return name;
}

void SurveyStore::MakeDirectory(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory))
    throw std::runtime_error(directory.string() + ": cannot be made a directory: " +
                             (error ? error.message() : "not a directory"));
}

Counters SurveyStoreCounters::ByName() const {
  return {{"store_saved", saved},
          {"store_write_errors", write_errors},
          {"store_read_errors", read_errors},
          {"store_lost", lost},
          {"store_missing", missing},
          {"store_cached_kb", cached_bytes / 1000}};
}

std::string SurveyStoreCounters::PointsLost(std::int64_t not_stored) const {
  std::string text;
  const auto add = [&text](std::int64_t count, const char* what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + what;
  };
  add(missing, " without a file");
  add(lost, " never written");
  add(not_stored, " closed while the disk did not respond");
  add(read_errors, " times a file could not be read");
  return text;
}

SurveyStoreCounters SurveyStore::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

std::shared_ptr<const Submap> SurveyStore::Get(SubmapId id) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(id);
  if (found == entries_.end()) return nullptr;
  Entry& entry = found->second;
  if (entry.cached) {
    recent_.splice(recent_.begin(), recent_, entry.place);
    return entry.cached;
  }
  if (!entry.saved) return nullptr;
  try {
    auto submap = std::make_shared<Submap>(entry.without_points);
    submap->cloud = ReadSubmapPcd(PcdPath(id)).cloud;
    std::shared_ptr<const Submap> result = std::move(submap);
    Cache(id, result);
    return result;
  } catch (const std::exception&) {
    ++counters_.read_errors;
    return nullptr;
  }
}

bool SurveyStore::Save(const Submap& submap, bool first) {
  try {
    if (std::filesystem::create_directories(dive_))
      SyncFolder(std::filesystem::absolute(dive_).parent_path());
    // A dive starts with an empty index, so that a replay of the same log writes the same files
    // again.
    if (first) std::filesystem::remove(dive_ / kSubmapIndex);
    WriteSubmapPcd(PcdPath(submap.id), submap.cloud, submap.T_map_submap, params_.power_cut);
    if (!AppendToIndex(submap)) return false;
    if (params_.power_cut == PowerCut::kLeavesFile) SyncFolder(dive_);
  } catch (const std::exception&) {
    return false;
  }
  return true;
}

bool SurveyStore::AppendToIndex(const Submap& submap) {
  return Append(dive_ / kSubmapIndex,
                IndexLine(submap, PcdPath(submap.id).filename().string()),
                params_.power_cut);
}

std::filesystem::path SurveyStore::PcdPath(SubmapId id) const { return dive_ / SubmapFileName(id); }

void SurveyStore::Cache(SubmapId id, std::shared_ptr<const Submap> submap) {
  Entry& entry = entries_.at(id);
  entry.cached = std::move(submap);
  recent_.push_front(id);
  entry.place = recent_.begin();
  (entry.saved ? counters_.cached_bytes : counters_.unsaved_bytes) += entry.bytes;
  Evict();
}

void SurveyStore::Drop(SubmapId id) {
  Entry& entry = entries_.at(id);
  entry.cached.reset();
  recent_.erase(entry.place);
  (entry.saved ? counters_.cached_bytes : counters_.unsaved_bytes) -= entry.bytes;
  if (!entry.saved) ++counters_.lost;
}

void SurveyStore::Evict() {
  // Drops the least recently used submaps. Saved and unsaved ones have a limit each.
  for (auto it = recent_.end(); it != recent_.begin();) {
    const auto last = std::prev(it);
    const SubmapId id = *last;
    const bool saved = entries_.at(id).saved;
    const bool over = saved ? counters_.cached_bytes > params_.max_cached_mb * kMegabyte
                            : counters_.unsaved_bytes > params_.max_unsaved_mb * kMegabyte;
    if (over) {
      Drop(id);
    } else {
      it = last;
    }
  }
}

}  // namespace seastitch
