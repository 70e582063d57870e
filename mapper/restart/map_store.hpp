#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/files/file_identity.hpp"
#include "common/storage/event_log.hpp"
#include "mapper/restart/saved_map.hpp"

// Files that a mapper needs for its restart, in the map's folder of a dive:
//
//   map/journal_000.lcmlog ...   One LCM event log per start of the mapper. No later start appends
//                                to it, so a damaged end affects this file only.
//   map/checkpoint_0, _1         written in turns, before each closed submap and every 5 s
//   map-2/ ...                   the same files of a second map, if the first cannot be continued
//
// Events: JOURNAL_START (format and configuration), then JOURNAL_ENTRY; each is CRC-32, number,
// bytes. Numbers count up from 0 over all segments.
namespace seastitch {

// The newest map of a dive, as found at a start.
struct FoundMap {
  std::filesystem::path folder;   // folder of the map
  std::optional<SavedMap> saved;  // its state, if it can be continued
  // Its sound-speed profiles: the dive keeps them where the map cannot be continued.
  std::vector<SoundVelocityProfile> profiles;
  std::string why_not;  // reason why it cannot be continued; empty if it can, or if there is none
  std::string lost;     // what could not be read, for people; empty: nothing
  std::int64_t next_entry = 0;  // number of the next entry
  int next_segment = 0;
};

// Folder of the newest map, beside the first map's folder.
std::filesystem::path NewestMap(const std::filesystem::path& map);
bool HasJournal(const std::filesystem::path& map);
// The sound-speed profiles of a map that is not read otherwise.
std::vector<SoundVelocityProfile> ProfilesOf(const std::filesystem::path& map);
// A map that must not be read; why: the reason.
FoundMap GiveUpMap(const std::filesystem::path& newest_map, std::string why);
// map: the first map's folder in the dive. configuration: as for MapJournal; a map with another
// configuration cannot be continued. Damaged files never cause an exception.
FoundMap FindMap(const std::filesystem::path& map, const std::string& configuration);
// Folder for the next map: map-2, map-3, ...
std::filesystem::path NextMapFolder(const std::filesystem::path& folder);

// Writes journal and checkpoints to the disk. After a write error, entries are kept and tried again
// with the next one, up to max_unsaved_mb; beyond that the journal ends. Never throws. Not
// thread-safe.
class MapJournal {
 public:
  // Writes nothing before the first entry or checkpoint.
  MapJournal(const FoundMap& map, std::string configuration, std::int64_t max_unsaved_mb);
  // Both return false if anything is not on the disk. time: of navigation, for the log.
  bool Append(Time time, std::vector<std::uint8_t> entry);
  bool WriteCheckpoint(Time time, const std::vector<std::uint8_t>& checkpoint);
  // Ends the journal: an entry is missing, so that none may follow.
  void End() { ended_ = true; }
  // True while the file that is written was deleted, or another disk hides it: entries wait, and a
  // restart begins another map. It is looked at with every entry and checkpoint.
  bool is_gone() const { return is_gone_; }

 private:
  struct Unsaved {
    Time time;
    std::vector<std::uint8_t> event;
  };
  void Write();
  void OpenSegment(Time time);
  bool CheckPlace();
  void Warn(const char* reason);

  const std::filesystem::path folder_;
  const std::string configuration_;
  const std::int64_t max_unsaved_bytes_;
  int segment_;
  std::int64_t next_entry_;
  std::unique_ptr<EventLogWriter> log_;
  std::optional<FileIdentity> identity_;  // of log_
  bool is_gone_ = false;
  std::deque<Unsaved> unsaved_;
  std::int64_t unsaved_bytes_ = 0;
  bool synced_ = true;  // all entries so far are on the disk
  bool ended_ = false;  // End(), or max_unsaved_mb was exceeded: entries are missing from here on
  int slot_ = 0;
  bool warned_ = false;
};

}  // namespace seastitch
