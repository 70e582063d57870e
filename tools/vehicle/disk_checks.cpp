#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "common/runtime/files/dive_folder.hpp"
#include "drivers/socket/file_descriptor.hpp"
#include "page/process_roll.hpp"
#include "tools/vehicle/machine_checks.hpp"

// The checks of machine_checks.hpp that concern the disk and its dives.
namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kGigabyte = 1e9;
constexpr char kOtherDisk[] =
    "Make room: fetch old dives and delete them, or name a data disk (docs/operations.md).";

// A test file without a name where the file system knows such files; elsewhere it loses its name at
// once. However the doctor ends, nothing is left.
class TrialFile {
 public:
  explicit TrialFile(const fs::path& folder) {
    fd_ = FileDescriptor(open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600));
    if (fd_ || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) {
      error_ = fd_ ? 0 : errno;
      return;
    }
    const fs::path path = folder / (".doctor-" + std::to_string(getpid()));
    fd_ = FileDescriptor(open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
    error_ = fd_ ? 0 : errno;
    if (fd_) unlink(path.c_str());
  }

  // Writes to the disk for at most 64 MB and about 1.5 s; returns MB/s. Nothing if it failed:
  // error().
  double Write() {
    const std::vector<char> block(1 << 20, 'x');
    const auto begin = std::chrono::steady_clock::now();
    double seconds = 0.0;
    int blocks = 0;
    while (error_ == 0 && blocks < 64 && seconds < 1.5) {
      const ssize_t wrote = write(fd_.get(), block.data(), block.size());
      if (wrote != static_cast<ssize_t>(block.size())) error_ = wrote < 0 ? errno : ENOSPC;
      if (error_ == 0 && fdatasync(fd_.get()) != 0) error_ = errno;
      ++blocks;
      seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
    return seconds > 0.0 ? 1.048576 * blocks / seconds : 0.0;
  }
  int error() const { return error_; }

 private:
  FileDescriptor fd_;
  int error_ = 0;
};

Finding RoomFinding(const fs::path& folder) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error)
    return Error("disk_free", "disk: " + folder.string() + ": " + error.message(), kOtherDisk);
  const double free_gb = static_cast<double>(space.available) / kGigabyte;
  // The design load, including RAW_*, is 3 MB/s.
  char text[160];
  std::snprintf(text, sizeof text, ": %.1f GB free, %.1f h of 3 MB/s", free_gb, free_gb / 10.8);
  const std::string is = "disk of " + folder.string() + text;
  if (free_gb < 1.0) return Error("disk_free", is, kOtherDisk);
  if (free_gb < 5.0) return Warning("disk_free", is, kOtherDisk);
  return Ok("disk_free", is);
}

Finding SpeedFinding(const fs::path& folder) {
  TrialFile file(folder);
  const double mb_per_s = file.Write();
  if (file.error() == EACCES)
    return Warning("disk_speed",
                   "disk of " + folder.string() + ": may not be written to by you",
                   "Run the doctor with sudo.");
  if (file.error() != 0)
    return Error(
        "disk_speed",
        "disk of " + folder.string() + ": cannot be written: " + std::strerror(file.error()),
        "Check the data disk: mounted, writable, not full; and the kernel's log (dmesg).");
  char text[60];
  std::snprintf(text, sizeof text, ": writes %.0f MB/s", mb_per_s);
  const std::string is = "disk of " + folder.string() + text;
  // Twice the design load.
  if (mb_per_s < 6.0)
    return Error("disk_speed", is, "The recording would fall behind: another disk.");
  return Ok("disk_speed", is);
}

bool IsBelow(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

std::string UnitOf(const std::string& process) { return "seastitch-" + process + ".service"; }

// Whether one of the paths, such as of ReadWritePaths, is the folder or above it.
bool Covers(const std::string& paths, const fs::path& folder) {
  std::istringstream words(paths);
  for (std::string path; words >> path;)
    if (IsBelow(folder, path.substr(path.starts_with('-') ? 1 : 0))) return true;
  return false;
}

// Mount point of a mount unit: /data/a-b of "data-a\\x2db.mount"; empty for another unit.
fs::path MountPointOf(const std::string& unit) {
  const fs::path name = unit;
  if (name.extension() != ".mount") return {};
  std::string path = "/";
  const std::string escaped = name.stem();
  for (std::size_t i = 0; i < escaped.size(); ++i) {
    if (escaped[i] == '\\' && i + 3 < escaped.size()) {
      path += static_cast<char>(std::strtol(escaped.substr(i + 2, 2).c_str(), nullptr, 16));
      i += 3;
    } else {
      path += escaped[i] == '-' ? '/' : escaped[i];
    }
  }
  return path == "//" ? "/" : path;  // of "-.mount"
}

// Names of the units that mount a disk for the folder.
std::set<std::string> MountsFor(const fs::path& folder, const std::string& units) {
  std::istringstream words(units);
  std::set<std::string> mounts;
  for (std::string unit; words >> unit;)
    if (const fs::path at = MountPointOf(unit); at.has_relative_path() && IsBelow(folder, at))
      mounts.insert(unit);
  return mounts;
}

Findings DropInFindings(const std::string& process,
                        std::map<std::string, std::string>& unit,
                        const fs::path& dives_dir) {
  const bool requires_disk = Covers(unit["RequiresMountsFor"], dives_dir);
  const std::string remedy =
      "See \"Data disk\" in docs/operations.md; then sudo systemctl daemon-reload.";
  const std::string name = "drop-in of " + process + " for " + dives_dir.string();
  if (process != "logger" && requires_disk)
    return {Warning("data_disk",
                    name + ": RequiresMountsFor, so that systemd stops it when the disk drops out",
                    remedy)};
  if (process != "logger" && process != "mapper") return {};
  if (!Covers(unit["ReadWritePaths"], dives_dir))
    return {Error("data_disk", name + ": no ReadWritePaths, so that it may not write", remedy)};
  if (process == "logger" && !requires_disk)
    return {
        Warning("data_disk",
                name + ": no RequiresMountsFor, so that it may start before the disk is mounted",
                remedy)};
  const std::set<std::string> awaited = MountsFor(dives_dir, unit["After"]);
  const std::set<std::string> wanted = MountsFor(dives_dir, unit["Wants"]);
  const bool waits = std::any_of(
      wanted.begin(), wanted.end(), [&](const auto& mount) { return awaited.contains(mount); });
  if (process == "mapper" && !waits)
    return {Warning("data_disk",
                    name + ": no Wants and After of the disk's mount unit, so that it may start "
                           "before the disk is mounted",
                    remedy)};
  return {Ok("data_disk", name + ": in place")};
}

// Device of the disk with the folder, or with the one in which it is to be made.
dev_t DeviceOf(fs::path folder) {
  struct stat status {};
  while (stat(folder.c_str(), &status) != 0 && folder.has_relative_path())
    folder = folder.parent_path();
  return status.st_dev;
}

// "DIVE_...: mapper, logger": a dive and its processes that did not stop properly.
std::string Unended(const DiveRecord& record) {
  std::string names;
  for (const auto& [name, process] : record.processes)
    if (!process.stopped) names += (names.empty() ? "" : ", ") + name;
  return names;
}

}  // namespace

Findings CheckDisk(const fs::path& dives_dir) {
  std::error_code error;
  const bool is_there = fs::exists(dives_dir, error);
  if (error)
    return {Warning("disk_free",
                    "folder of the dives: " + dives_dir.string() + ": " + error.message(),
                    "Run the doctor with sudo.")};
  // The processes create the last folder if its parent exists.
  const fs::path folder = is_there ? dives_dir : dives_dir.parent_path();
  if (!fs::is_directory(folder, error))
    return {Error("disk_free",
                  "folder of the dives: " + dives_dir.string() + " is not there",
                  "Make it, or mount its disk: sudo install -d -o seastitch -g seastitch -m 0750 " +
                      dives_dir.parent_path().string())};
  return {RoomFinding(folder), SpeedFinding(folder)};
}

Findings CheckDataDisk(const Machine& machine, const fs::path& dives_dir) {
  if (IsBelow(dives_dir, "/var/lib/seastitch")) return {};
  std::vector<std::string> processes(kProcesses.begin(), kProcesses.end());
  processes.insert(processes.end(), kOptionalProcesses.begin(), kOptionalProcesses.end());
  std::vector<std::string> units;
  for (const std::string& process : processes) units.push_back(UnitOf(process));
  UnitProperties shown =
      ShowUnits(machine, units, "LoadState,ReadWritePaths,RequiresMountsFor,Wants,After");
  Findings findings;
  for (const std::string& process : processes)
    if (auto& unit = shown[UnitOf(process)]; unit["LoadState"] == "loaded")  // run by systemd
      Append(DropInFindings(process, unit, dives_dir), &findings);
  if (Covers(shown[UnitOf("logger")]["RequiresMountsFor"], dives_dir) &&
      DeviceOf(dives_dir) == DeviceOf(machine.root))
    findings.push_back(Warning("data_disk",
                               "data disk of " + dives_dir.string() +
                                   ": not mounted, the folder is on the computer's own disk",
                               "Mount it: findmnt --target " + dives_dir.string() +
                                   " names the disk; check /etc/fstab and the disk's cable."));
  return findings;
}

Findings CheckLastDive(const fs::path& dives_dir, std::int64_t now_utime) {
  constexpr std::int64_t kAlive = 30'000'000;  // the sign of life is written every 10 s
  fs::path last;
  DiveRecord record;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(dives_dir, missing)) {
    try {
      const DiveRecord read = ReadDiveRecord(entry.path());
      const bool runs = now_utime - read.last_utime < kAlive && !Unended(read).empty();
      if (runs || read.number <= record.number) continue;
      last = entry.path();
      record = read;
    } catch (const std::exception&) {  // not a dive, or its record was lost
    }
  }
  if (last.empty()) return {Ok("last_dive", "last dive: none yet")};
  const std::string name = "last dive " + last.filename().string();
  const std::string unended = Unended(record);
  if (unended.empty()) return {Ok("last_dive", name + ": ended in order")};
  return {Warning("last_dive",
                  name + ": not ended in order by " + unended + " (power cut, or crash)",
                  "Look at it before you dive: seastitch info " + last.string() +
                      "/log/000.lcmlog, journalctl -u 'seastitch-*'.")};
}

}  // namespace seastitch
