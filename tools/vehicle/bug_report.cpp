#include "tools/vehicle/bug_report.hpp"

#include <stdlib.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "common/core/channel_names.hpp"
#include "common/core/time.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/process/process.hpp"
#include "common/storage/event_log.hpp"
#include "survey/read/recorded_dive.hpp"
#include "tools/vehicle/doctor.hpp"
#include "tools/vehicle/machine.hpp"
#include "tools/vehicle/piped_child.hpp"
#include "tools/vehicle/setup.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr double kAtMostS = 30.0;  // time limit of a program whose output is packed
constexpr double kDiskS = 60.0;    // time limit of reading the dives

// A temporary folder, deleted with its content at the end.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "seastitch_report_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error(pattern + ": cannot be made");
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void Write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
}

// Each command with its output and, unless it is 0, its exit status. A program that names a fault,
// such as `systemctl status`, has one.
std::string Answers(const std::vector<Words>& commands) {
  std::string text;
  for (const Words& command : commands) {
    text += "$";
    for (const std::string& word : command) text += " " + word;
    const ChildResult result = RunProgram(command, kAtMostS);
    text += "\n" + result.output;
    if (!result.exit_status)
      text += "(no end within 30 s)\n";
    else if (*result.exit_status != 0)
      text += "(exit status " + std::to_string(*result.exit_status) + ")\n";
    text += "\n";
  }
  return text;
}

using Json = nlohmann::ordered_json;

// from: where the message was found.
Json HealthJson(const health_t& health, const std::string& from) {
  Json json{{"from", from},
            {"utime", health.utime},
            {"version", health.version},
            {"uptime_s", health.uptime_s},
            {"restarts", health.restarts},
            {"state", health.state},
            {"text", health.text}};
  for (const condition_t& condition : health.conditions)
    json["conditions"][condition.name] = {{"sentence", condition.sentence},
                                          {"since_utime", condition.since_utime},
                                          {"count", condition.count}};
  for (const counter_t& counter : health.counters) json["counters"][counter.name] = counter.value;
  for (std::size_t i = 0; i < health.rate_hz.size(); ++i)
    json["rates_hz"][health.rate_names[i]] = health.rate_hz[i];
  return json;
}

std::string Print(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// The last HEALTH of each process in a log.
std::map<std::string, health_t> HealthIn(const fs::path& log) {
  std::map<std::string, health_t> last;
  EventLogReader reader(log);
  while (const auto event = reader.Next()) {
    health_t msg{};
    const int size = static_cast<int>(event->data.size());
    if (event->channel == channels::kHealth && msg.decode(event->data.data(), 0, size) == size)
      last[msg.process] = msg;
  }
  return last;
}

// The last HEALTH of each process in the newest dive. A process that ended long before the dive is
// in one of its first logs.
Json RecordedHealth(const fs::path& dives_dir) {
  Json all = Json::object();
  const std::optional<fs::path> dive = NewestDive(dives_dir);
  if (!dive) return all;
  std::vector<fs::path> logs = LogsOfDive(*dive);
  std::reverse(logs.begin(), logs.end());
  for (const fs::path& log : logs) {
    for (const auto& [process, health] : HealthIn(log))
      if (!all.contains(process)) all[process] = HealthJson(health, log.string());
    if (std::all_of(kProcesses.begin(), kProcesses.end(), [&](const char* process) {
          return all.contains(process);
        }))
      break;
  }
  return all;
}

// The last HEALTH of each process: from the bus, else from the newest dive.
Json LastHealth(const ProcessRoll& roll, Json recorded) {
  for (const std::string& process : roll.names())
    if (const health_t* const health = roll.Find(process))
      recorded[process] = HealthJson(*health, "bus");
    else if (!recorded.contains(process))
      recorded[process] = nullptr;
  return recorded;
}

void CopyConfiguration(const fs::path& from, const fs::path& to) {
  fs::create_directory(to);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(from, error))
    if (entry.is_regular_file(error))
      fs::copy_file(entry.path(), to / entry.path().filename(), error);
  if (error) Write(to / "ERROR.txt", from.string() + ": " + error.message() + "\n");
}

void CopyDives(const fs::path& dives_dir, const fs::path& to) {
  std::error_code missing;
  std::map<std::string, fs::path> newest;  // names begin with the time
  for (const auto& entry : fs::directory_iterator(dives_dir, missing))
    newest[entry.path().filename().string()] = entry.path();
  while (newest.size() > 5) newest.erase(newest.begin());
  for (const auto& [name, path] : newest)
    fs::copy_file(path / "dive.json", to / (name + ".json"), missing);
}

// Packs the records of the newest dives, and returns the last HEALTH that they have. In a process
// of its own, because the disk may hang.
Json PackDives(const fs::path& dives_dir, const fs::path& to) {
  fs::create_directory(to);
  PipedChild child([&](int out) {
    CopyDives(dives_dir, to);
    return WriteText(out, Print(RecordedHealth(dives_dir)));
  });
  const ChildResult result = child.WaitUntil(MonotonicSeconds() + kDiskS);
  Json recorded = Json::parse(result.output, nullptr, false);
  if (recorded.is_object()) return recorded;
  Write(to / "ERROR.txt", dives_dir.string() + ": no log of a dive can be read\n");
  return Json::object();
}

}  // namespace

int RunBugReport(const BugReportOptions& options) {
  const std::string name =
      "seastitch-report-" + UtcText(FromUtime(std::time(nullptr) * 1'000'000), "%Y%m%dT%H%M%SZ");
  const fs::path out = fs::absolute(options.out.empty() ? fs::path(name + ".tar.gz") : options.out);
  if (fs::exists(out)) throw std::runtime_error(out.string() + ": exists already");
  const Folder work;
  const fs::path folder = work.path() / name;
  fs::create_directory(folder);

  Write(folder / "versions.txt",
        std::string("seastitch ") + ProgramVersion() + "\n\n" +
            Answers({{"uname", "-a"},
                     {"cat", "/etc/os-release"},
                     {"dpkg-query",
                      "-W",
                      "seastitch*",
                      "liblcm*",
                      "libpcl-*",
                      "libceres*",
                      "systemd",
                      "linux-image-*"}}));
  CopyConfiguration(options.config_dir, folder / "config");
  std::printf("asking the processes and looking at the computer: some seconds\n");
  std::fflush(stdout);
  DoctorOptions doctor;
  doctor.config_dir = options.config_dir;
  doctor.lcm_url = options.lcm_url;
  const Examination examination = Examine(doctor);
  Write(folder / "doctor.txt", ToText(examination.findings, 100));
  Write(folder / "doctor.json", ToJson(examination.findings));
  for (const auto& [process, files] : examination.configs) {
    const fs::path running = folder / "running" / process;
    fs::create_directories(running);
    for (const auto& [file, text] : files) Write(running / fs::path(file).filename(), text);
  }
  Write(folder / "machine.txt",
        Answers({{"cat", "/proc/meminfo"},
                 {"cat", "/proc/loadavg"},
                 {"lscpu"},
                 {"df", "-h"},
                 {"ip", "-details", "address"},
                 {"ip", "route"},
                 {"chronyc", "tracking"},
                 {"timedatectl"}}));
  Write(folder / "systemd.txt",
        Answers({{"systemctl", "--no-pager", "status", "seastitch-*", "lcm-loopback.service"},
                 {"systemctl", "cat", "seastitch-*", "lcm-loopback.service"}}));
  Write(folder / "journal.txt",
        Answers({{"journalctl",
                  "--no-pager",
                  "-n",
                  "20000",
                  "-u",
                  "seastitch-*",
                  "-u",
                  "lcm-loopback.service"}}));
  Findings ignored;
  const Setup setup = LoadSetup(options.config_dir, &ignored);
  Json recorded = Json::object();
  if (const auto logger = setup.dives.find("logger"); logger != setup.dives.end())
    recorded = PackDives(logger->second.dives_dir, folder / "dives");
  Write(folder / "health.json", Print(LastHealth(examination.roll, recorded)));

  if (RunProgram({"tar", "-C", work.path().string(), "-czf", out.string(), name}, kAtMostS)
          .exit_status != 0)
    throw std::runtime_error(out.string() + ": cannot be written");
  std::printf(
      "%s: look at it before you send it; it has your configuration and the names of your "
      "network, no sensor's data\n",
      out.c_str());
  return EXIT_SUCCESS;
}

}  // namespace seastitch
