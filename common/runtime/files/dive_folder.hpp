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

#include "common/parameters/parameters.hpp"

// The folder of a dive, which logger and mapper share:
//
//   DIVES_DIR/DIVE_20261122T101500Z/
//     log/     all messages of the bus except RAW_* (logger)
//     raw/     messages RAW_*, the raw bytes of devices (logger)
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
  // Longest time since the dive's last heartbeat after which a process continues it [s].
  double resume_within_s = 1800.0;
};
// Declares the parameters dives_dir and dive_resume_within_s.
void DeclareDive(DiveParams* params, ParameterTable* table);
// Makes dives_dir absolute; in the file it is relative to the configuration file's folder.
void ResolveDivesDir(const std::string& config_file, DiveParams* params);
// Throws ConfigError "FILE: dives_dir: ..." where a process could not start: neither the folder nor
// the one that it is to be made in is there, or it cannot be written to.
void CheckDivesDir(const DiveParams& params, const std::string& config_file);

// Content of dive.json.
struct DiveRecord {
  struct Process {
    std::string version;
    int starts = 0;
    std::int64_t start_utime = 0;  // of the last start
    std::int64_t last_utime = 0;
    bool stopped = false;  // regularly; false while it runs, and after a crash or power cut
  };
  std::int64_t number = 0;  // 1, 2, 3, ...: in order whatever the clock did
  std::string host;
  std::int64_t start_utime = 0;
  std::int64_t last_utime = 0;  // last heartbeat
  bool closed = false;          // by `seastitch dive new`: no process continues it
  std::map<std::string, Process> processes;
};
// Throws std::runtime_error "FILE: reason".
DiveRecord ReadDiveRecord(const std::filesystem::path& dive);

// Number of a log: 12 for .../012.lcmlog. Absent for any other name.
std::optional<int> LogNumber(const std::filesystem::path& file);
// Name of a log: 012.lcmlog for 12.
std::string LogName(int number);

// A dive that this process takes part in.
class DiveFolder {
 public:
  // Continues the newest dive of dives_dir if it is not closed and its last heartbeat is at most
  // resume_within_s ago, or in the future (the clock was set back). Else begins a new dive. Several
  // processes may do so at the same time. If the disk cannot be written (read-only, full, failed),
  // continues the newest dive whatever its age, without writing to dive.json, so that the processes
  // of a vehicle under way start. kInAnyCase: after any other error too. Throws std::runtime_error
  // "FOLDER: reason" where there is no dive, either; kIfDiskFailed: ConfigError after any other
  // error, such as a wrong owner.
  enum class JoinNewest { kIfDiskFailed, kInAnyCase };
  DiveFolder(const DiveParams& params,
             std::string process,
             std::int64_t now_utime,
             JoinNewest when = JoinNewest::kInAnyCase);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path log() const { return path_ / "log"; }
  std::filesystem::path raw() const { return path_ / "raw"; }
  std::filesystem::path map() const { return path_ / "map"; }
  std::filesystem::path config() const { return path_ / "config"; }
  // True: another process, or an earlier start of this one, began the dive.
  bool resumed() const { return resumed_; }
  // A newer dive whose dive.json cannot be read, so that this process began another: "FILE:
  // reason". That dive has a file not_continued.txt now, and is not named again. Empty: none.
  const std::string& damaged() const { return damaged_; }

  // Writes the start of the process to dive.json. Call it once the process may write to its folder
  // of the dive: a process that is refused leaves no trace. Logs a warning where it cannot be
  // written.
  void Enter(std::int64_t now_utime) const;
  // Both write dive.json. They throw std::runtime_error where it cannot be written.
  void SignOfLife(std::int64_t now_utime) const;
  void End(std::int64_t now_utime) const;  // the process stops regularly

 private:
  void JoinOrBegin(const DiveParams& params, std::int64_t now_utime);
  void Update(std::int64_t now_utime, bool stopped) const;

  std::filesystem::path path_;
  std::string process_;
  bool resumed_ = false;
  std::string damaged_;
};

// Writes heartbeats to dive.json from a thread of its own, because a disk may not respond. A failed
// one is repeated with the next.
class DiveKeeper {
 public:
  explicit DiveKeeper(DiveFolder dive);
  ~DiveKeeper();
  // Ends the heartbeats, because the process stops regularly.
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

// Folders of all dives whose dive.json can be read, by rising number.
std::vector<std::filesystem::path> DivesInOrder(const std::filesystem::path& dives_dir);
// The dive with the largest number; absent where no dive.json can be read.
std::optional<std::filesystem::path> NewestDive(const std::filesystem::path& dives_dir);
// Closes the newest dive, so that the next start of a process begins a new one. Returns that dive;
// absent where there was none to close. Throws as DiveFolder.
std::optional<std::filesystem::path> CloseNewestDive(const std::filesystem::path& dives_dir);

}  // namespace seastitch
