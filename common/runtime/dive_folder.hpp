#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/parameters.hpp"

// One folder a dive, shared by logger and mapper:
//
//   DIVES_DIR/DIVE_20261122T101500Z/
//     log/     what was on the bus (logger), but for
//     raw/     RAW_*, the devices' bytes (logger)
//     map/     submaps, journal, checkpoint (mapper)
//     config/  the configuration that every process published (logger)
//     dive.json
//
// The logs are 000.lcmlog, 001.lcmlog, ... in the order in which they were written.
//
// Times are microseconds of the wall clock, which may be set at any moment.
namespace seastitch {

struct DiveParams {
  std::filesystem::path dives_dir = "../dives";
  // After the last sign of life; later a process begins a new dive.
  double resume_within_s = 1800.0;
};
// dives_dir and dive_resume_within_s.
void DeclareDive(DiveParams* params, ParameterTable* table);
// Makes dives_dir absolute: it is relative to the configuration's file.
void ResolveDivesDir(const std::string& config_file, DiveParams* params);
// Throws ConfigError "FILE: dives_dir: ..." where a process could not start: neither the folder nor
// the one that it is to be made in is there, or it cannot be written to.
void CheckDivesDir(const DiveParams& params, const std::string& config_file);

// dive.json.
struct DiveRecord {
  struct Process {
    std::string version;
    int starts = 0;
    std::int64_t start_utime = 0;  // of the last start
    std::int64_t last_utime = 0;
    bool stopped = false;  // in order; false while it runs, and where it crashed or lost its power
  };
  std::int64_t number = 0;  // 1, 2, 3, ...: in order whatever the clock did
  std::string host;
  std::int64_t start_utime = 0;
  std::int64_t last_utime = 0;  // sign of life, as it was written last
  bool closed = false;          // `seastitch dive new`: nobody joins it any more
  std::map<std::string, Process> processes;
};
// Throws std::runtime_error "FILE: reason".
DiveRecord ReadDiveRecord(const std::filesystem::path& dive);

// Of .../012.lcmlog: 12. Nothing for any other name.
std::optional<int> LogNumber(const std::filesystem::path& file);
// Of 12: 012.lcmlog.
std::string LogName(int number);

// A dive that this process takes part in.
class DiveFolder {
 public:
  // Joins the newest dive of dives_dir where it is not closed and its last sign of life is at most
  // resume_within_s ago (or lies in the future: the clock has gone back); else begins one. Safe
  // against others that do the same. On a disk that takes nothing any more it joins the newest,
  // however old, without a record of it: a vehicle that is under way needs its processes more.
  // Throws std::runtime_error "FOLDER: reason" where there is none.
  DiveFolder(const DiveParams& params, std::string process, std::int64_t now_utime);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path log() const { return path_ / "log"; }
  std::filesystem::path raw() const { return path_ / "raw"; }
  std::filesystem::path map() const { return path_ / "map"; }
  std::filesystem::path config() const { return path_ / "config"; }
  // Another process, or an earlier start of this one, began it.
  bool resumed() const { return resumed_; }

  // Both write dive.json and throw std::runtime_error where the disk does not take it.
  void SignOfLife(std::int64_t now_utime) const;
  void End(std::int64_t now_utime) const;  // the process stops in order

 private:
  void JoinOrBegin(const DiveParams& params, std::int64_t now_utime);
  void Update(std::int64_t now_utime, bool stopped) const;

  std::filesystem::path path_;
  std::string process_;
  bool resumed_ = false;
};

// Gives signs of life from a thread of its own, since a disk may hang. What fails is tried again
// with the next one.
class DiveKeeper {
 public:
  explicit DiveKeeper(DiveFolder dive);
  ~DiveKeeper();
  // No more signs of life: the process stops in order.
  void End();
  DiveKeeper(const DiveKeeper&) = delete;
  DiveKeeper& operator=(const DiveKeeper&) = delete;

 private:
  void Main();
  void Stop();

  const DiveFolder dive_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::thread thread_;
};

// Those whose record can be read, by their numbers.
std::vector<std::filesystem::path> DivesInOrder(const std::filesystem::path& dives_dir);
// The newest dive by its number; nothing where there is none that can be read.
std::optional<std::filesystem::path> NewestDive(const std::filesystem::path& dives_dir);
// Closes the newest dive, so that the next start of a process begins a new one. Gives it; nothing
// where there was none to close. Throws as DiveFolder.
std::optional<std::filesystem::path> CloseNewestDive(const std::filesystem::path& dives_dir);

}  // namespace seastitch
