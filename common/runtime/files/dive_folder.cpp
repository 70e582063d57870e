#include "common/runtime/files/dive_folder.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/core/time.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/health.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kSignOfLife(10);
constexpr int kFormat = 1;
constexpr char kLogExtension[] = ".lcmlog";
constexpr char kDivePrefix[] = "DIVE_";
constexpr char kSetAside[] = "not_continued.txt";  // in a dive whose record cannot be read

std::runtime_error FolderError(const fs::path& folder, const std::string& reason) {
  return std::runtime_error(folder.string() + ": " + reason);
}

std::string HostName() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? name : "";
}

// Exclusive lock of a folder of dives, held until it is destroyed.
class Lock {
 public:
  explicit Lock(const fs::path& dives_dir)
      : fd_(::open((dives_dir / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0660)) {
    if (fd_ < 0 || ::flock(fd_, LOCK_EX) != 0) {
      const int error = errno;
      if (fd_ >= 0) ::close(fd_);
      throw FolderError(dives_dir, std::strerror(error));
    }
  }
  ~Lock() { ::close(fd_); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  int fd_;
};

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  // One level only: a data disk that is not mounted must not become a directory of the root disk.
  if (fs::create_directory(folder, error)) SyncFolder(folder.parent_path());
  if (error) throw FolderError(folder, error.message());
}

// True if the disk is why nothing can be written here, and not an owner, a mode or a name.
bool HasFailedDisk(const fs::path& folder) {
  std::string name = (folder / ".written-XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  int error = fd < 0 ? errno : 0;
  if (fd >= 0) {
    if (::write(fd, "x", 1) != 1 || ::fsync(fd) != 0) error = errno;
    ::close(fd);
    ::unlink(name.c_str());
  }
  return error == EROFS || error == ENOSPC || error == EIO || error == EDQUOT;
}

Json ToJson(const DiveRecord& record) {
  Json json{{"format", kFormat},
            {"number", record.number},
            {"host", record.host},
            {"start", UtcText(FromUtime(record.start_utime))},
            {"start_utime", record.start_utime},
            {"last_sign_of_life", UtcText(FromUtime(record.last_utime))},
            {"last_sign_of_life_utime", record.last_utime},
            {"closed", record.closed}};
  for (const auto& [name, process] : record.processes)
    json["processes"][name] = {{"version", process.version},
                               {"starts", process.starts},
                               {"start_utime", process.start_utime},
                               {"last_sign_of_life_utime", process.last_utime},
                               {"stopped", process.stopped}};
  return json;
}

DiveRecord FromJson(const Json& json) {
  if (json.at("format").get<int>() != kFormat) throw std::runtime_error("of another format");
  DiveRecord record;
  json.at("number").get_to(record.number);
  json.at("host").get_to(record.host);
  json.at("start_utime").get_to(record.start_utime);
  json.at("last_sign_of_life_utime").get_to(record.last_utime);
  json.at("closed").get_to(record.closed);
  if (!json.contains("processes")) return record;
  for (const auto& [name, value] : json["processes"].items()) {
    DiveRecord::Process& process = record.processes[name];
    value.at("version").get_to(process.version);
    value.at("starts").get_to(process.starts);
    value.at("start_utime").get_to(process.start_utime);
    value.at("last_sign_of_life_utime").get_to(process.last_utime);
    value.at("stopped").get_to(process.stopped);
  }
  return record;
}

void Write(const fs::path& dive, const DiveRecord& record) {
  WriteDurably(dive / "dive.json", ToJson(record).dump(2) + "\n");
}

// The record of a dive; nothing if it cannot be read.
std::optional<DiveRecord> TryRead(const fs::path& dive) {
  try {
    return ReadDiveRecord(dive);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

struct DamagedDive {
  fs::path path;
  std::string why;  // "FILE: reason"
};

// The newest folder of a dive after `last`, if its record cannot be read and it was not set aside
// yet. The names of dives, DIVE_20261122T101500Z, are in order of time.
std::optional<DamagedDive> DamagedAfter(const fs::path& last, const fs::path& dives_dir) {
  const std::string least = kDivePrefix + std::string("0"), most = kDivePrefix + std::string(":");
  fs::path newest;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dives_dir, error)) {
    const std::string name = entry.path().filename().string();
    if (name >= least && name < most && name > last.filename() && name > newest.filename() &&
        entry.is_directory(error))
      newest = entry.path();
  }
  if (newest.empty() || fs::exists(newest / kSetAside, error)) return std::nullopt;
  try {
    ReadDiveRecord(newest);
  } catch (const std::exception& e) {
    return DamagedDive{newest, e.what()};
  }
  return std::nullopt;
}

// So that the processes that start after this one join its dive, whatever the clock says.
void SetAside(const DamagedDive& dive) {
  try {
    WriteDurably(dive.path / kSetAside, dive.why + "\n");
  } catch (const std::exception& e) {
    spdlog::warn("{}", e.what());
  }
}

struct Found {
  fs::path path;
  DiveRecord record;
};

std::vector<Found> FindAll(const fs::path& dives_dir) {
  std::vector<Found> dives;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dives_dir, error))
    if (const auto record = TryRead(entry.path())) dives.push_back({entry.path(), *record});
  std::sort(dives.begin(), dives.end(), [](const Found& a, const Found& b) {
    return std::tie(a.record.number, a.path) < std::tie(b.record.number, b.path);
  });
  return dives;
}

std::optional<Found> FindNewest(const fs::path& dives_dir) {
  const std::vector<Found> dives = FindAll(dives_dir);
  return dives.empty() ? std::nullopt : std::optional(dives.back());
}

bool GoesOn(const DiveRecord& record, double resume_within_s, std::int64_t now_utime) {
  const double silent_s = 1e-6 * static_cast<double>(now_utime - record.last_utime);
  return !record.closed && silent_s <= resume_within_s;
}

// Makes a folder with a name that is not taken.
fs::path MakeDive(const fs::path& dives_dir, std::int64_t now_utime) {
  const std::string name = kDivePrefix + UtcText(FromUtime(now_utime), "%Y%m%dT%H%M%SZ");
  fs::path dive = dives_dir / name;
  for (int n = 2; fs::exists(dive); ++n) dive = dives_dir / (name + "_" + std::to_string(n));
  MakeFolder(dive);
  for (const char* part : {"log", "raw", "map", "config"}) MakeFolder(dive / part);
  return dive;
}

void NoteStart(const std::string& process, std::int64_t now_utime, DiveRecord* record) {
  DiveRecord::Process& own = record->processes[process];
  own.version = SEASTITCH_VERSION;
  ++own.starts;
  own.start_utime = own.last_utime = record->last_utime = now_utime;
  own.stopped = false;
}

}  // namespace

void DeclareDive(DiveParams* params, ParameterTable* table) {
  const Parameter& dives_dir =
      table->Add("dives_dir",
                 &params->dives_dir,
                 "Folder of the dives, one folder each, on the data disk (docs/operations.md); the "
                 "same for logger and mapper. It is created if its parent exists.");
  table->AddRule(
      dives_dir, "the name of a directory", [params] { return !params->dives_dir.empty(); });
  table->Add("dive_resume_within_s",
             &params->resume_within_s,
             Unit::kSecond,
             Range::AtLeast(0.0),
             "Longest pause after which a start continues the last dive; the same for logger and "
             "mapper. After a longer one, or after `seastitch dive new`, a new dive begins.");
}

void ResolveDivesDir(const std::string& config_file, DiveParams* params) {
  const fs::path dir = fs::absolute(config_file).parent_path() / params->dives_dir;
  params->dives_dir = (dir / "").lexically_normal().parent_path();  // without a slash at its end
}

void CheckDivesDir(const DiveParams& params, const std::string& config_file) {
  const fs::path dir = params.dives_dir;
  const fs::path needed = fs::is_directory(dir) ? dir : dir.parent_path();
  const auto fail = [&](const std::string& expected) {
    throw ConfigError(config_file + ": dives_dir: '" + dir.string() + "' is not " + expected);
  };
  if (fs::exists(dir) && !fs::is_directory(dir)) fail("a directory");
  if (!fs::is_directory(needed)) fail("in a directory that is there");
  // A disk that the kernel has set read-only after an error is not a configuration error.
  if (::access(needed.c_str(), W_OK | X_OK) != 0 && errno != EROFS)
    fail("one that this user may write to");
}

DiveRecord ReadDiveRecord(const fs::path& dive) {
  const fs::path file = dive / "dive.json";
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FolderError(file, "cannot be opened: " + std::string(std::strerror(errno)));
  try {
    return FromJson(Json::parse(in));
  } catch (const std::exception& e) {
    throw FolderError(file, "is no record of a dive: " + std::string(e.what()));
  }
}

std::optional<int> LogNumber(const fs::path& file) {
  const std::string stem = file.stem().string();
  int number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  const bool is_number = error == std::errc() && end == stem.data() + stem.size() && number >= 0;
  return is_number && file.extension() == kLogExtension ? std::optional(number) : std::nullopt;
}

std::string LogName(int number) {
  char name[32];
  std::snprintf(name, sizeof name, "%03d%s", number, kLogExtension);
  return name;
}

DiveFolder::DiveFolder(const DiveParams& params,
                       std::string process,
                       std::int64_t now_utime,
                       JoinNewest when)
    : process_(std::move(process)) {
  try {
    JoinOrBegin(params, now_utime);
  } catch (const std::exception& e) {
    const std::optional<Found> newest = FindNewest(params.dives_dir);
    if (!newest) throw;
    if (when == JoinNewest::kIfDiskFailed && !HasFailedDisk(params.dives_dir))
      throw ConfigError(e.what());
    spdlog::warn("{}; goes on in {}", e.what(), newest->path.string());
    path_ = newest->path;
    resumed_ = true;
  }
}

void DiveFolder::JoinOrBegin(const DiveParams& params, std::int64_t now_utime) {
  MakeFolder(params.dives_dir);
  const Lock lock(params.dives_dir);
  const std::optional<Found> newest = FindNewest(params.dives_dir);
  const auto damaged = DamagedAfter(newest ? newest->path : fs::path(), params.dives_dir);
  if (damaged) {
    damaged_ = damaged->why;
    spdlog::warn("{}", damaged_);
    SetAside(*damaged);
  }
  resumed_ = newest && !damaged && GoesOn(newest->record, params.resume_within_s, now_utime);
  if (resumed_) {
    path_ = newest->path;
    return;
  }
  path_ = MakeDive(params.dives_dir, now_utime);
  DiveRecord record;
  record.number = newest ? newest->record.number + 1 : 1;
  record.host = HostName();
  record.start_utime = record.last_utime = now_utime;
  Write(path_, record);
}

void DiveFolder::Enter(std::int64_t now_utime) const {
  try {
    const Lock lock(path_.parent_path());
    DiveRecord record = ReadDiveRecord(path_);
    NoteStart(process_, now_utime, &record);
    Write(path_, record);
  } catch (const std::exception& e) {
    spdlog::warn("{}", e.what());
  }
}

void DiveFolder::SignOfLife(std::int64_t now_utime) const { Update(now_utime, false); }

void DiveFolder::End(std::int64_t now_utime) const { Update(now_utime, true); }

void DiveFolder::Update(std::int64_t now_utime, bool stopped) const {
  const Lock lock(path_.parent_path());
  DiveRecord record = ReadDiveRecord(path_);
  DiveRecord::Process& own = record.processes[process_];
  own.last_utime = record.last_utime = now_utime;
  own.stopped = stopped;
  Write(path_, record);
}

DiveKeeper::DiveKeeper(DiveFolder dive) : dive_(std::move(dive)), thread_([this] { Main(); }) {}

DiveKeeper::~DiveKeeper() { Stop(); }

void DiveKeeper::End() {
  Stop();
  try {
    dive_.End(NowUtime());
  } catch (const std::exception& e) {
    spdlog::warn("{}", e.what());
  }
}

void DiveKeeper::Stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void DiveKeeper::Main() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kSignOfLife, [this] { return stop_; })) {
    lock.unlock();
    try {
      dive_.SignOfLife(NowUtime());
    } catch (const std::exception&) {
      // Logger and mapper report a failing disk themselves.
    }
    lock.lock();
  }
}

std::vector<fs::path> DivesInOrder(const fs::path& dives_dir) {
  std::vector<fs::path> dives;
  for (const Found& dive : FindAll(dives_dir)) dives.push_back(dive.path);
  return dives;
}

std::optional<fs::path> NewestDive(const fs::path& dives_dir) {
  const std::optional<Found> newest = FindNewest(dives_dir);
  return newest ? std::optional(newest->path) : std::nullopt;
}

std::optional<fs::path> CloseNewestDive(const fs::path& dives_dir) {
  const Lock lock(dives_dir);
  std::optional<Found> newest = FindNewest(dives_dir);
  if (!newest || newest->record.closed) return std::nullopt;
  newest->record.closed = true;
  Write(newest->path, newest->record);
  return newest->path;
}

}  // namespace seastitch
