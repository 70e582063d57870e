#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bench/live.hpp"
#include "bench/survey_config.hpp"
#include "common/runtime/bus.hpp"
#include "tools/live/child_process.hpp"

namespace seastitch {

// Runs seven processes of a vehicle as child processes: three drivers (IMU, DVL, sonar), mapper,
// optimizer, logger, page. They use their own LCM URL and free UDP ports of the loopback interface.
// Folders in OUT: config/ (shipped files, adapted to the simulated survey), dives/, log/ (output of
// each process).
class LiveSystem {
 public:
  // Starts them. Throws std::runtime_error.
  LiveSystem(const std::filesystem::path& out, const bench::SurveyConfig& survey);

  const std::filesystem::path& config_dir() const { return config_; }
  std::filesystem::path dives_dir() const { return out_ / "dives"; }
  // Folder of the newest dive.
  std::filesystem::path dive() const;
  const bench::LiveTargets& targets() const { return targets_; }
  // URL of the page, for a browser on this computer.
  std::string page() const { return "http://" + page_; }
  std::vector<std::string> names() const;

  // These throw std::runtime_error if a process ends, or does not answer in time (20 s; 60 s to
  // stop).
  void WaitUntilUp();
  // Call it several times a second while the survey runs: handles received messages, so that the
  // receive buffer does not overflow.
  void Poll();
  // What processes lost or heard out of time, as HEALTH reported it, a line each: "mapper
  // input_missed 3"; empty: nothing.
  std::string Lost() const;
  // Faults in the last HEALTH of each process: " mapper: clock_step late_samples"; empty: none.
  std::string Faults() const;
  // Stops the drivers first; then the mapper, which closes its last submap; the optimizer when it
  // has solved the last graph version; the logger last.
  void Stop();

  // kill -9.
  void Kill(const std::string& name);
  // Starts a process as systemd does: with a runtime directory that is kept after the process ends.
  void Start(const std::string& name);

 private:
  // Follows the bus: processes that sent HEALTH, last version of the graph and of its solution.
  class Listener {
   public:
    explicit Listener(const std::string& url);
    bool WaitUntil(const std::function<bool()>& done, std::chrono::seconds timeout);
    void HandleAll() { bus_.HandleAll(); }
    std::size_t alive() const { return alive_.size(); }
    bool solved() const { return solved_ >= mapped_; }
    const std::map<std::string, std::int64_t>& lost() const { return lost_; }
    const std::map<std::string, std::string>& faults() const { return faults_; }

   private:
    Bus bus_;
    std::set<std::string> alive_;
    std::map<std::string, std::int64_t> lost_;   // by process and figure
    std::map<std::string, std::string> faults_;  // by process, in its last HEALTH
    std::int64_t mapped_ = 0;                    // last version of the graph
    std::int64_t solved_ = 0;                    // last version that is solved
  };

  void CheckRunning();
  void StopOne(const std::string& name);

  std::filesystem::path out_;
  std::filesystem::path config_;
  std::vector<int> ports_;
  std::string page_;
  std::string lcm_url_;
  bench::LiveTargets targets_;
  Listener listener_;
  std::map<std::string, int> starts_;
  std::list<ChildProcess> processes_;
};

}  // namespace seastitch
