#include "tools/vehicle/bug_report.hpp"

#include <stdlib.h>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "common/runtime/process.hpp"
#include "tools/vehicle/doctor.hpp"
#include "tools/vehicle/machine.hpp"
#include "tools/vehicle/setup.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr int kAtMostS = 30;  // time limit of a program whose output is packed

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

std::string TimeText() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[40];
  return std::string(text, std::strftime(text, sizeof text, "%Y%m%dT%H%M%SZ", &utc));
}

// Each command with its output.
std::string Answers(const std::vector<Words>& commands) {
  std::string text;
  for (const Words& command : commands) {
    text += "$";
    for (const std::string& word : command) text += " " + word;
    text += "\n" + RunProgram(command, kAtMostS).value_or("(not to be had here)\n") + "\n";
  }
  return text;
}

// The last HEALTH of each process, as JSON.
std::string HealthJson(const ProcessRoll& roll) {
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  for (const std::string& process : roll.names()) {
    const health_t* const health = roll.Find(process);
    all[process] = nullptr;
    if (health == nullptr) continue;
    nlohmann::ordered_json json{{"utime", health->utime},
                                {"version", health->version},
                                {"uptime_s", health->uptime_s},
                                {"restarts", health->restarts},
                                {"state", health->state},
                                {"text", health->text}};
    for (const condition_t& condition : health->conditions)
      json["conditions"][condition.name] = {{"sentence", condition.sentence},
                                            {"since_utime", condition.since_utime},
                                            {"count", condition.count}};
    for (const counter_t& counter : health->counters)
      json["counters"][counter.name] = counter.value;
    for (std::size_t i = 0; i < health->rate_hz.size(); ++i)
      json["rates_hz"][health->rate_names[i]] = health->rate_hz[i];
    all[process] = json;
  }
  return all.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
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
  fs::create_directory(to);
  std::error_code missing;
  std::map<std::string, fs::path> newest;  // names begin with the time
  for (const auto& entry : fs::directory_iterator(dives_dir, missing))
    newest[entry.path().filename().string()] = entry.path();
  while (newest.size() > 5) newest.erase(newest.begin());
  for (const auto& [name, path] : newest)
    fs::copy_file(path / "dive.json", to / (name + ".json"), missing);
}

}  // namespace

int RunBugReport(const BugReportOptions& options) {
  const std::string name = "seastitch-report-" + TimeText();
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
  Write(folder / "health.json", HealthJson(examination.roll));
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
  if (const auto logger = setup.dives.find("logger"); logger != setup.dives.end())
    CopyDives(logger->second.dives_dir, folder / "dives");

  if (!RunProgram({"tar", "-C", work.path().string(), "-czf", out.string(), name}, kAtMostS))
    throw std::runtime_error(out.string() + ": cannot be written");
  std::printf(
      "%s: look at it before you send it; it has your configuration and the names of your "
      "network, no sensor's data\n",
      out.c_str());
  return EXIT_SUCCESS;
}

}  // namespace seastitch
