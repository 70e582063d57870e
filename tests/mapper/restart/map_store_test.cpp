#include "mapper/restart/map_store.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "mapper/restart/map_starts.hpp"
#include "tests/support/files.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
const std::string kConfiguration = "vehicle: one\n";

void WriteFile(const fs::path& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

Checkpoint CheckpointOf(std::int64_t number, std::int32_t next_submap) {
  Checkpoint checkpoint;
  checkpoint.number = number;
  checkpoint.time = FromUtime(1'000'000 * number);
  checkpoint.next_submap = next_submap;
  checkpoint.navigation = {1, 2, 3};
  return checkpoint;
}

// A profile, then a submap that closes and joins the graph, and so on.
std::vector<JournalEntry> Entries(int submaps) {
  std::vector<JournalEntry> entries{SoundVelocityProfile{FromUtime(1), {0.0}, {1500.0}}};
  for (int id = 0; id < submaps; ++id) {
    const auto submap = std::make_shared<Submap>();
    submap->id = SubmapId{id};
    submap->footprint = {{1.0, 2.0}};
    entries.emplace_back(ClosedSubmap{submap, {}, false});
    GraphGrowth growth;
    growth.closed = SubmapId{id};
    growth.steps.push_back({GraphUpdate{id + 1, {{SubmapId{id}, FromUtime(id), {}}}, {}}, {}});
    entries.emplace_back(growth);
  }
  return entries;
}

// The checkpoint that goes before an entry: that of a closed submap.
void WriteCheckpointOf(const JournalEntry& entry, MapJournal* journal) {
  const auto* closed = std::get_if<ClosedSubmap>(&entry);
  if (closed == nullptr) return;
  const std::int32_t id = closed->submap->id.value;
  EXPECT_TRUE(
      journal->WriteCheckpoint(FromUtime(1'000'000), Encode(CheckpointOf(10 * id + 5, id + 1))));
}

void Write(const FoundMap& map, const std::vector<JournalEntry>& entries) {
  MapJournal journal(map, kConfiguration, 100);
  for (const JournalEntry& entry : entries) {
    WriteCheckpointOf(entry, &journal);
    EXPECT_TRUE(journal.Append(FromUtime(1'000'000), Encode(entry)));
  }
}

// Those of `whole` from its beginning.
void ExpectBeginningOf(const std::vector<JournalEntry>& whole, const SavedMap& saved) {
  ASSERT_LE(saved.journal.size(), whole.size());
  for (std::size_t i = 0; i < saved.journal.size(); ++i)
    EXPECT_EQ(Encode(saved.journal[i]), Encode(whole[i])) << i;
}

class MapStore : public testing::Test {
 protected:
  MapStore() : map_(dir_ / "map") { fs::create_directory(map_); }
  FoundMap Find() const { return FindMap(map_, kConfiguration); }
  fs::path Segment(int n) const { return map_ / ("journal_00" + std::to_string(n) + ".lcmlog"); }

  TemporaryDir dir_;
  const fs::path map_;
};

TEST_F(MapStore, ReadsWhatItHasWritten) {
  EXPECT_FALSE(Find().saved);
  EXPECT_EQ(Find().why_not, "");
  EXPECT_EQ(Find().folder, map_);
  const std::vector<JournalEntry> entries = Entries(3);
  Write(Find(), entries);
  const FoundMap found = Find();
  ASSERT_TRUE(found.saved);
  EXPECT_EQ(found.saved->journal.size(), entries.size());
  ExpectBeginningOf(entries, *found.saved);
  EXPECT_EQ(found.saved->checkpoint.number, 25) << "of the submap closed last";
  EXPECT_EQ(found.lost, "");
  EXPECT_EQ(found.next_segment, 1);
}

TEST_F(MapStore, TakesTheNewestCheckpointThatIsWhole) {
  MapJournal journal(Find(), kConfiguration, 100);
  for (std::int64_t number = 1; number <= 4; ++number)
    EXPECT_TRUE(journal.WriteCheckpoint(FromUtime(number), Encode(CheckpointOf(number, 0))));
  ASSERT_TRUE(Find().saved) << "before any entry";
  EXPECT_EQ(Find().saved->checkpoint.number, 4);
  const fs::path newest = map_ / "checkpoint_1";
  const std::vector<std::uint8_t> whole = BytesOf(newest);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    WriteFile(newest, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    ASSERT_TRUE(Find().saved) << size;
    EXPECT_EQ(Find().saved->checkpoint.number, 3) << size;
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::vector<std::uint8_t> damaged = whole;
    damaged[at] ^= 0x40;
    WriteFile(newest, damaged);
    ASSERT_TRUE(Find().saved) << at;
    EXPECT_EQ(Find().saved->checkpoint.number, 3) << at;
  }
}

// The power goes after a submap's checkpoint and before its entry.
TEST_F(MapStore, TakesACheckpointThatKnowsNoMoreSubmapsThanTheJournal) {
  const std::vector<JournalEntry> entries = Entries(3);
  MapJournal journal(Find(), kConfiguration, 100);
  for (std::size_t i = 0; i + 2 < entries.size(); ++i) {
    WriteCheckpointOf(entries[i], &journal);
    EXPECT_TRUE(journal.Append(FromUtime(1), Encode(entries[i])));
  }
  EXPECT_TRUE(journal.WriteCheckpoint(FromUtime(1), Encode(CheckpointOf(16, 2))));
  WriteCheckpointOf(entries[entries.size() - 2], &journal);
  EXPECT_EQ(Find().saved->checkpoint.number, 16);
  EXPECT_EQ(Find().saved->next_submap, 3) << "its number is used up";
  EXPECT_EQ(Find().lost, "1 closed submaps of its journal");
  {
    // The mapper goes on with the number after it, and stops again: nothing more is lost.
    const auto submap = std::make_shared<Submap>();
    submap->id = SubmapId{3};
    const JournalEntry next = ClosedSubmap{submap, {}, false};
    MapJournal gone_on(Find(), kConfiguration, 100);
    EXPECT_TRUE(gone_on.WriteCheckpoint(FromUtime(1), Encode(CheckpointOf(35, 4))));
    EXPECT_TRUE(gone_on.Append(FromUtime(1), Encode(next)));
    EXPECT_EQ(Find().saved->checkpoint.number, 35);
    EXPECT_EQ(Find().lost, "");
  }
}

// Cut at every length, and gone on with: what was whole before the cut is there, and all that comes
// after the restart.
TEST_F(MapStore, ACutAnywhereCostsOnlyWhatComesAfterItInItsSegment) {
  const std::vector<JournalEntry> entries = Entries(3);
  Write(Find(), entries);
  const std::vector<std::uint8_t> whole = BytesOf(Segment(0));
  std::size_t most = 0;
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    SCOPED_TRACE(size);
    fs::remove(Segment(1));
    WriteFile(Segment(0), {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    const FoundMap found = Find();
    const std::size_t kept = found.saved ? found.saved->journal.size() : 0;
    if (found.saved) ExpectBeginningOf(entries, *found.saved);
    EXPECT_GE(kept, most) << "a longer journal holds no less";
    most = std::max(most, kept);
    ASSERT_EQ(found.next_segment, 1);
    if (size % 7 != 0) continue;
    const auto next = static_cast<std::size_t>(found.next_entry);
    Write(found, {entries.begin() + static_cast<std::ptrdiff_t>(next), entries.end()});
    const FoundMap gone_on = Find();
    if (next == entries.size()) continue;  // nothing was left to write
    ASSERT_TRUE(gone_on.saved);
    EXPECT_EQ(gone_on.saved->journal.size(), entries.size());
    ExpectBeginningOf(entries, *gone_on.saved);
  }
  EXPECT_EQ(most, entries.size());
}

TEST_F(MapStore, DamageIsNamedAndWhatFollowsAHoleIsNotUsed) {
  const std::vector<JournalEntry> entries = Entries(3);
  Write(Find(), entries);
  std::vector<std::uint8_t> bytes = BytesOf(Segment(0));
  bytes[bytes.size() / 2] ^= 1;
  WriteFile(Segment(0), bytes);
  const FoundMap found = Find();
  EXPECT_NE(found.lost.find("of its journal"), std::string::npos) << found.lost;
  ASSERT_TRUE(found.saved);
  EXPECT_LT(found.saved->journal.size(), entries.size());
  ExpectBeginningOf(entries, *found.saved);
}

TEST_F(MapStore, AnotherConfigurationIsAnotherMap) {
  Write(Find(), Entries(1));
  const FoundMap found = FindMap(map_, "vehicle: another\n");
  EXPECT_FALSE(found.saved);
  EXPECT_NE(found.why_not, "");
}

TEST_F(MapStore, AJournalThatIsGoneOrEmptyIsNamed) {
  Write(Find(), Entries(3));
  MapJournal(Find(), kConfiguration, 100)
      .WriteCheckpoint(FromUtime(1), Encode(CheckpointOf(40, 3)));
  for (int n = 0; fs::exists(Segment(n)); ++n) WriteFile(Segment(n), {});
  const FoundMap empty = Find();
  ASSERT_TRUE(empty.saved) << "navigation goes on";
  EXPECT_EQ(empty.lost, "3 closed submaps of its journal");
  for (int n = 0; fs::exists(Segment(n)); ++n) fs::remove(Segment(n));
  EXPECT_FALSE(Find().saved);
  EXPECT_EQ(Find().why_not, "its journal is missing");
}

// The dive's water is the same for its next map.
TEST_F(MapStore, TheProfilesOfAMapThatCannotBeContinuedAreKept) {
  Write(Find(), Entries(2));
  EXPECT_EQ(FindMap(map_, "vehicle: another\n").profiles.size(), 1U);
  EXPECT_EQ(ProfilesOf(map_).size(), 1U);
}

TEST_F(MapStore, FindsTheNewestMap) {
  Write(Find(), Entries(2));
  FoundMap next;
  next.folder = NextMapFolder(map_);
  EXPECT_EQ(next.folder, dir_ / "map-2");
  Write(next, Entries(1));
  const FoundMap found = Find();
  EXPECT_EQ(found.folder, dir_ / "map-2");
  ASSERT_TRUE(found.saved);
  EXPECT_EQ(found.saved->journal.size(), 3U);
  EXPECT_EQ(NextMapFolder(found.folder), dir_ / "map-3");
}

// The folder is not there for a while, as where a disk is unplugged.
TEST_F(MapStore, WritesLaterWhatTheDiskDidNotTake) {
  const std::vector<JournalEntry> entries = Entries(3);
  MapJournal journal(Find(), kConfiguration, 100);
  fs::remove(map_);
  std::ofstream(map_) << "in the way";
  EXPECT_FALSE(journal.Append(FromUtime(1), Encode(entries[0])));
  EXPECT_FALSE(journal.WriteCheckpoint(FromUtime(1), Encode(CheckpointOf(99, 9))))
      << "without the entries that it goes with";
  EXPECT_FALSE(journal.Append(FromUtime(1), Encode(entries[1])));
  fs::remove(map_);
  for (std::size_t i = 2; i < entries.size(); ++i)
    EXPECT_TRUE(journal.Append(FromUtime(1), Encode(entries[i])));
  WriteCheckpointOf(entries[entries.size() - 2], &journal);
  const FoundMap found = Find();
  ASSERT_TRUE(found.saved);
  EXPECT_EQ(found.saved->journal.size(), entries.size());
  EXPECT_EQ(found.saved->checkpoint.number, 25);
}

// Somebody deletes the dive, or another disk is mounted over it: writing to the open file would
// succeed, and nothing would be there after a restart.
TEST_F(MapStore, NoticesThatItsFolderIsGoneAndBack) {
  const std::vector<JournalEntry> entries = Entries(3);
  MapJournal journal(Find(), kConfiguration, 100);
  EXPECT_TRUE(journal.Append(FromUtime(1), Encode(entries[0])));
  EXPECT_TRUE(journal.WriteCheckpoint(FromUtime(1), Encode(CheckpointOf(99, 9))));
  EXPECT_FALSE(journal.is_gone());
  fs::rename(map_, dir_ / "elsewhere");
  fs::create_directory(map_);
  EXPECT_FALSE(journal.WriteCheckpoint(FromUtime(2), Encode(CheckpointOf(100, 9))));
  EXPECT_TRUE(journal.is_gone());
  EXPECT_FALSE(journal.Append(FromUtime(2), Encode(entries[1])));
  EXPECT_TRUE(fs::is_empty(map_)) << "no half of a journal";
  // It comes back, as where a disk is mounted again: what waited is written.
  fs::remove(map_);
  fs::rename(dir_ / "elsewhere", map_);
  EXPECT_TRUE(journal.Append(FromUtime(3), Encode(entries[2])));
  EXPECT_FALSE(journal.is_gone());
  EXPECT_TRUE(journal.WriteCheckpoint(FromUtime(3), Encode(CheckpointOf(101, 9))));
  const FoundMap found = Find();
  ASSERT_TRUE(found.saved);
  EXPECT_EQ(found.saved->journal.size(), 3u) << "with the one that came meanwhile";
}

TEST_F(MapStore, EndsTheJournalWhereTooMuchWaits) {
  MapJournal journal(Find(), kConfiguration, 0);
  EXPECT_FALSE(journal.Append(FromUtime(1), Encode(Entries(1)[0])));
  EXPECT_FALSE(journal.WriteCheckpoint(FromUtime(1), Encode(CheckpointOf(99, 9))));
  EXPECT_FALSE(Find().saved);
}

TEST_F(MapStore, CountsMappersThatEndedSoonAfterTheyWentOn) {
  for (int ended = 0; ended < 3; ++ended) {
    MapStarts starts(map_);
    EXPECT_EQ(starts.ended_soon(), ended);
    starts.Begin();
    for (double now_s = 100.0; now_s < 109.0; ++now_s) starts.Tick(false, now_s);
    for (double now_s = 109.0; now_s < 118.5; ++now_s) starts.Tick(true, now_s);
  }
  {
    MapStarts survivor(map_);
    EXPECT_EQ(survivor.ended_soon(), 3);
    survivor.Begin();
    for (double now_s = 0.0; now_s < 11.0; ++now_s) survivor.Tick(true, now_s);
  }
  EXPECT_EQ(MapStarts(map_).ended_soon(), 0);
}

TEST_F(MapStore, AMapperThatEndsInOrderOrWaitsForItsSensorsHasSurvived) {
  MapStarts stopped(map_);
  stopped.Begin();
  EXPECT_EQ(MapStarts(map_).ended_soon(), 1);
  stopped.Survive();
  EXPECT_EQ(MapStarts(map_).ended_soon(), 0);
  MapStarts waiting(map_);
  waiting.Begin();
  for (double now_s = 0.0; now_s < 11.0; ++now_s) waiting.Tick(false, now_s);
  EXPECT_EQ(MapStarts(map_).ended_soon(), 0);
}

TEST_F(MapStore, CountsNothingOfADamagedCountOrWhereItCannotWrite) {
  for (const char* text : {"", "-5", "many", "99999999999999999999"}) {
    std::ofstream(map_ / "starts") << text;
    EXPECT_EQ(MapStarts(map_).ended_soon(), 0) << text;
  }
  MapStarts nowhere(dir_ / "no" / "folder");
  EXPECT_NO_THROW(nowhere.Begin());
  EXPECT_EQ(nowhere.ended_soon(), 0);
}

TEST_F(MapStore, DoesNotReadAMapThatIsGivenUp) {
  EXPECT_FALSE(HasJournal(map_));
  Write(Find(), Entries(3));
  EXPECT_TRUE(HasJournal(map_));
  const FoundMap found = GiveUpMap(NewestMap(map_), "it ended three");
  EXPECT_FALSE(found.saved);
  EXPECT_EQ(found.why_not, "it ended three");
  EXPECT_EQ(found.folder, map_);
}

}  // namespace
}  // namespace seastitch
