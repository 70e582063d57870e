#include "mapper/restart/map_store.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>
#include <variant>

#include "common/core/bytes.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "common/storage/crc32.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr char kStart[] = "JOURNAL_START";
constexpr char kEntry[] = "JOURNAL_ENTRY";
constexpr int kSlots = 2;
constexpr std::int64_t kMegabyte = 1'000'000;

// CRC-32 of the number and the bytes, then both.
std::vector<std::uint8_t> Sealed(std::int64_t number, Bytes bytes) {
  ByteWriter content;
  content.Le(number);
  content.Append(bytes);
  ByteWriter sealed;
  sealed.Le(Crc32(content.bytes()));
  sealed.Append(content.bytes());
  return sealed.Release();
}

struct Opened {
  std::int64_t number;
  Bytes bytes;
};
std::optional<Opened> Open(Bytes sealed) {
  ByteReader reader(sealed);
  const auto crc = reader.Le<std::uint32_t>();
  const auto number = reader.Le<std::int64_t>();
  if (!reader.ok() || crc != Crc32(sealed.subspan(sizeof crc))) return std::nullopt;
  return Opened{number, sealed.subspan(reader.at())};
}

fs::path SegmentPath(const fs::path& folder, int segment) {
  char name[40];
  std::snprintf(name, sizeof name, "journal_%03d.lcmlog", segment);
  return folder / name;
}

fs::path SlotPath(const fs::path& folder, int slot) {
  return folder / ("checkpoint_" + std::to_string(slot));
}

// Number and path of the segments, in order.
std::vector<std::pair<int, fs::path>> SegmentsIn(const fs::path& folder) {
  std::vector<std::pair<int, fs::path>> segments;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    int number = 0;
    char rest = 0;
    const std::string name = entry.path().filename().string();
    if (std::sscanf(name.c_str(), "journal_%d.lcmlo%c", &number, &rest) == 2 && rest == 'g')
      segments.emplace_back(number, entry.path());
  }
  std::sort(segments.begin(), segments.end());
  return segments;
}

std::vector<std::uint8_t> StartOf(const std::string& configuration) {
  ArchiveWriter archive;
  archive(kJournalFormat, Crc32(AsBytes(configuration)));
  return archive.Release();
}

// Reads the segments of one map.
class JournalReader {
 public:
  explicit JournalReader(const std::string& configuration) : start_(StartOf(configuration)) {}

  void Read(const fs::path& segment) {
    try {
      EventLogReader log(segment);
      while (const std::optional<LogEvent> event = log.Next()) Use(*event);
      damaged_bytes_ += log.damaged_bytes();
    } catch (const std::exception&) {  // no complete event in it
      std::error_code error;
      const auto size = fs::file_size(segment, error);
      if (!error) damaged_bytes_ += static_cast<std::int64_t>(size);
    }
  }
  void ReadCheckpoint(const fs::path& slot) {
    const std::string bytes = ReadWholeFile(slot).value_or("");
    const std::optional<Opened> opened = Open(AsBytes(bytes));
    if (!opened || opened->number != kJournalFormat) return;
    if (std::optional<Checkpoint> checkpoint = DecodeCheckpoint(opened->bytes))
      checkpoints_.push_back(*std::move(checkpoint));
  }

  bool is_of_another_configuration() const { return other_start_; }
  std::int64_t next_entry() const { return next_; }
  std::int64_t lost_entries() const { return lost_; }
  std::int64_t damaged_bytes() const { return damaged_bytes_; }
  // True if the journal is whole and holds nothing but profiles.
  bool HoldsProfilesAlone() const {
    return !entries_.empty() && lost_ == 0 && damaged_bytes_ == 0 &&
           std::all_of(entries_.begin(), entries_.end(), [](const JournalEntry& entry) {
             return std::holds_alternative<SoundVelocityProfile>(entry);
           });
  }
  // All profiles that can be read: a dive keeps them when its map cannot be continued.
  std::vector<SoundVelocityProfile> Profiles() const {
    std::vector<SoundVelocityProfile> profiles;
    for (const JournalEntry& entry : entries_)
      if (const auto* profile = std::get_if<SoundVelocityProfile>(&entry))
        profiles.push_back(*profile);
    return profiles;
  }
  // Number after that of the last closed submap. Numbers may have been left out: that of a submap
  // that was lost is not used again.
  std::int32_t NextSubmap() const {
    std::int32_t next = 0;
    for (const JournalEntry& entry : entries_)
      if (const auto* closed = std::get_if<ClosedSubmap>(&entry))
        next = std::max(next, closed->submap->id.value + 1);
    return next;
  }
  // A submap's checkpoint is written before its entry. Where the entry is missing, the checkpoint
  // before it fits the journal.
  std::optional<SavedMap> Take() {
    const std::int32_t next = NextSubmap();
    const auto newest = std::max_element(
        checkpoints_.begin(), checkpoints_.end(), [&](const Checkpoint& a, const Checkpoint& b) {
          const bool a_fits = a.next_submap <= next, b_fits = b.next_submap <= next;
          return std::pair(a_fits, a.number) < std::pair(b_fits, b.number);
        });
    if (newest == checkpoints_.end()) return std::nullopt;
    std::int32_t next_submap = 0;
    for (const Checkpoint& checkpoint : checkpoints_)
      next_submap = std::max(next_submap, checkpoint.next_submap);
    return SavedMap{std::move(entries_), std::move(*newest), next_submap};
  }

 private:
  void Use(const LogEvent& event) {
    const std::optional<Opened> opened = Open(event.data);
    if (!opened) {
      damaged_bytes_ += static_cast<std::int64_t>(event.data.size());
    } else if (event.channel == kStart) {
      other_start_ =
          other_start_ ||
          !std::equal(opened->bytes.begin(), opened->bytes.end(), start_.begin(), start_.end());
    } else if (event.channel == kEntry) {
      Add(*opened);
    }
  }
  // Entries after a gap are counted as lost: they do not continue the state before it.
  void Add(const Opened& opened) {
    if (opened.number != next_) {
      lost_ += opened.number > next_;
      return;
    }
    std::optional<JournalEntry> entry = DecodeJournalEntry(opened.bytes);
    if (!entry) {
      ++lost_;
      return;
    }
    ++next_;
    entries_.push_back(*std::move(entry));
  }

  const std::vector<std::uint8_t> start_;
  bool other_start_ = false;
  std::vector<JournalEntry> entries_;
  std::vector<Checkpoint> checkpoints_;  // that can be read
  std::int64_t next_ = 0;
  std::int64_t lost_ = 0;
  std::int64_t damaged_bytes_ = 0;
};

// True for a folder in which a map was made: it has checkpoints or clouds.
bool HoldsMap(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("checkpoint_") || entry.path().extension() == ".pcd") return true;
  }
  return false;
}

// Submaps that the checkpoint has and the journal lacks.
void AddLost(std::int32_t submaps, FoundMap* found) {
  if (submaps <= 0 || !found->lost.empty()) return;
  found->lost = std::to_string(submaps) + " closed submaps of its journal";
}

void WriteSynced(const fs::path& path, const std::vector<std::uint8_t>& bytes) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) throw std::runtime_error(path.string() + ": " + std::strerror(errno));
  const ssize_t written = ::write(fd, bytes.data(), bytes.size());
  const bool whole = written == static_cast<ssize_t>(bytes.size()) && ::fsync(fd) == 0;
  ::close(fd);
  if (!whole) throw std::runtime_error(path.string() + ": cannot be written: disk full?");
}

}  // namespace

fs::path NextMapFolder(const fs::path& folder) {
  const std::string name = folder.filename().string();
  const std::size_t dash = name.rfind('-');
  if (dash == std::string::npos) return folder.parent_path() / (name + "-2");
  const int number = std::atoi(name.c_str() + dash + 1);
  return folder.parent_path() / (name.substr(0, dash + 1) + std::to_string(number + 1));
}

fs::path NewestMap(const fs::path& map) {
  fs::path newest = map;
  for (fs::path next = NextMapFolder(map); fs::is_directory(next); next = NextMapFolder(next))
    newest = next;
  return newest;
}

bool HasJournal(const fs::path& map) { return !SegmentsIn(map).empty(); }

std::vector<SoundVelocityProfile> ProfilesOf(const fs::path& map) {
  JournalReader journal("");
  for (const auto& [number, path] : SegmentsIn(map)) journal.Read(path);
  return journal.Profiles();
}

FoundMap GiveUpMap(const fs::path& newest_map, std::string why) {
  FoundMap found;
  found.folder = newest_map;
  found.why_not = std::move(why);
  return found;
}

FoundMap FindMap(const fs::path& map, const std::string& configuration) {
  FoundMap found;
  found.folder = NewestMap(map);
  const auto segments = SegmentsIn(found.folder);
  if (segments.empty()) {
    if (HoldsMap(found.folder)) found.why_not = "its journal is missing";
    return found;
  }
  JournalReader journal(configuration);
  for (const auto& [number, path] : segments) journal.Read(path);
  for (int slot = 0; slot < kSlots; ++slot) journal.ReadCheckpoint(SlotPath(found.folder, slot));
  found.next_segment = segments.back().first + 1;
  found.next_entry = journal.next_entry();
  if (journal.lost_entries() > 0)
    found.lost = std::to_string(journal.lost_entries()) + " entries of its journal";
  else if (journal.damaged_bytes() > 0)
    found.lost = std::to_string(journal.damaged_bytes()) + " bytes of its journal";
  found.profiles = journal.Profiles();
  const std::int32_t next = journal.NextSubmap();
  const bool has_nothing_else = journal.HoldsProfilesAlone();
  if (journal.is_of_another_configuration())
    found.why_not = "the configuration or the format of the journal is another";
  else if (found.saved = journal.Take(); found.saved)
    AddLost(found.saved->next_submap - next, &found);
  else if (!has_nothing_else)
    found.why_not = "no checkpoint can be read";
  return found;
}

MapJournal::MapJournal(const FoundMap& map, std::string configuration, std::int64_t max_unsaved_mb)
    : folder_(map.folder),
      configuration_(std::move(configuration)),
      max_unsaved_bytes_(max_unsaved_mb * kMegabyte),
      segment_(map.next_segment),
      next_entry_(map.next_entry) {}

bool MapJournal::Append(Time time, std::vector<std::uint8_t> entry) {
  std::vector<std::uint8_t> event = Sealed(next_entry_++, entry);
  ended_ = ended_ || unsaved_bytes_ + static_cast<std::int64_t>(event.size()) > max_unsaved_bytes_;
  if (ended_) return false;
  unsaved_bytes_ += static_cast<std::int64_t>(event.size());
  unsaved_.push_back({time, std::move(event)});
  synced_ = false;
  if (!CheckPlace()) return false;
  try {
    Write();
    synced_ = true;
  } catch (const std::exception& e) {
    Warn(e.what());
  }
  return synced_;
}

void MapJournal::Write() {
  if (!log_) OpenSegment(unsaved_.front().time);
  while (!unsaved_.empty()) {
    const Unsaved& next = unsaved_.front();
    log_->Write(ToUtime(next.time), kEntry, next.event.data(), next.event.size());
    unsaved_bytes_ -= static_cast<std::int64_t>(next.event.size());
    unsaved_.pop_front();
  }
  log_->Sync();
}

void MapJournal::OpenSegment(Time time) {
  fs::create_directory(folder_);
  auto log = std::make_unique<EventLogWriter>(SegmentPath(folder_, segment_), IfExists::kReplace);
  const std::vector<std::uint8_t> start = Sealed(segment_, StartOf(configuration_));
  log->Write(ToUtime(time), kStart, start.data(), start.size());
  log->Sync();
  log_ = std::move(log);
  identity_ = IdentityOf(SegmentPath(folder_, segment_));
  SyncFolder(folder_);
  SyncFolder(folder_.parent_path());
}

// False while the path of the open file does not lead to it: it was deleted, or another disk hides
// it. The file stays open, since it may come back; nothing is written meanwhile.
bool MapJournal::CheckPlace() {
  const bool gone = log_ && IdentityOf(SegmentPath(folder_, segment_)) != identity_;
  if (gone && !is_gone_)
    spdlog::warn("{}: was deleted, or another disk hides it", folder_.string());
  if (!gone && is_gone_) spdlog::warn("{}: is back, and is written again", folder_.string());
  is_gone_ = gone;
  return !gone;
}

bool MapJournal::WriteCheckpoint(Time time, const std::vector<std::uint8_t>& checkpoint) {
  if (!CheckPlace()) return false;
  // the journal lacks the entries that the checkpoint refers to
  if (!synced_ || ended_) return false;
  try {
    if (!log_) OpenSegment(time);
    const fs::path slot = SlotPath(folder_, slot_);
    const bool is_new = !fs::exists(slot);
    WriteSynced(slot, Sealed(kJournalFormat, checkpoint));
    if (is_new) SyncFolder(folder_);
    slot_ = (slot_ + 1) % kSlots;
    warned_ = false;
    return true;
  } catch (const std::exception& e) {
    Warn(e.what());
    return false;
  }
}

// Logs an error once, until a write succeeds again; HEALTH reports the current state.
void MapJournal::Warn(const char* reason) {
  if (!std::exchange(warned_, true)) spdlog::warn("{}", reason);
}

}  // namespace seastitch
