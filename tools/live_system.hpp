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
#include "tools/child_process.hpp"

namespace seastitch {

// The six processes of a vehicle beside us, on an LCM URL of their own and free ports of the
// loopback interface. In OUT: config/ (the shipped one, made for the survey), dives/, log/ (what
// each process printed).
class LiveSystem {
 public:
  // Starts them. Throws std::runtime_error.
  LiveSystem(const std::filesystem::path& out, const bench::SurveyConfig& survey);

  const std::filesystem::path& config_dir() const { return config_; }
  std::filesystem::path dives_dir() const { return out_ / "dives"; }
  // What the logger wrote.
  std::filesystem::path dive() const;
  const bench::LiveTargets& targets() const { return targets_; }
  std::vector<std::string> names() const;

  // These throw std::runtime_error where a process does not do its part.
  void WaitUntilUp();
  // While the survey runs: hears the bus, so that its buffer does not fill.
  void Poll();
  // What processes said that was lost on its way to them: " mapper imu_lost 3"; empty: nothing.
  std::string Lost() const;
  // Drivers first, so that the mapper has all there is; then the mapper, which closes its last
  // submap; the optimizer when it has answered; the logger last.
  void Stop();

  // kill -9.
  void Kill(const std::string& name);
  // As the service manager does it: with a runtime directory that outlives the process.
  void Start(const std::string& name);

 private:
  // What we hear on the bus: who is alive, and how far the graph is solved.
  class Listener {
   public:
    explicit Listener(const std::string& url);
    bool WaitUntil(const std::function<bool()>& done, std::chrono::seconds patience);
    void HandleAll() { bus_.HandleAll(); }
    std::size_t alive() const { return alive_.size(); }
    bool solved() const { return solved_ >= mapped_; }
    const std::map<std::string, std::int64_t>& lost() const { return lost_; }

   private:
    Bus bus_;
    std::set<std::string> alive_;
    std::map<std::string, std::int64_t> lost_;  // by process and counter
    std::int64_t mapped_ = 0;
    std::int64_t solved_ = 0;
  };

  void CheckRunning();
  void StopOne(const std::string& name);

  std::filesystem::path out_;
  std::filesystem::path config_;
  std::vector<int> ports_;
  std::string lcm_url_;
  bench::LiveTargets targets_;
  Listener listener_;
  std::map<std::string, int> starts_;
  std::list<ChildProcess> processes_;
};

}  // namespace seastitch
