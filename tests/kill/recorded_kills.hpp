#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/time.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/graph_update_t.hpp"

// What a recording of a survey says of the processes that were killed in it.
namespace seastitch {

struct Kill {
  std::string process;
  Time at;
  Time restarted;
  std::optional<Time> back;  // its first output after that
};

// The logs of a folder, in order.
std::vector<std::filesystem::path> LogsIn(const std::filesystem::path& folder);

// Read from what a logger recorded that was never killed.
class RecordedKills {
 public:
  // log: the recording's folder of logs. dive: the folder of the survey, whose logger was killed.
  RecordedKills(std::vector<Kill> kills,
                const std::filesystem::path& log,
                const std::filesystem::path& dive);

  const std::vector<Kill>& kills() const { return kills_; }
  std::size_t submaps() const { return submaps_.size(); }
  // What a restart should have kept and did not, a sentence each.
  std::vector<std::string> Losses() const;

  // Copies a log of the same survey without what the kills cost at best: the killed process's
  // input until it was back, and the pings of the submap that a killed mapper had open.
  void Cut(const std::filesystem::path& whole, const std::filesystem::path& cut) const;

 private:
  struct Announced {
    std::set<std::int64_t> starts;  // one, unless the number was given twice
    std::int64_t announced_utime = 0;
    std::int64_t end_utime = 0;
  };
  struct Solution {
    std::int64_t version = 0;
    std::int64_t number = -1;
    std::size_t vertices = 0;
  };

  void Read(const std::filesystem::path& log);
  void Use(const LogEvent& event);
  void FindBack();
  std::int64_t LastSubmapEnd(Time before) const;
  bool Lost(const LogEvent& event, const Kill& kill) const;

  std::vector<Kill> kills_;
  const std::filesystem::path dive_;
  // By wall clock: what each process puts out, and the optimizer's requests for the graph.
  std::map<std::string, std::set<std::int64_t>> outputs_;
  std::set<std::int64_t> requests_;
  std::optional<std::int64_t> first_update_utime_;
  std::map<std::int32_t, Announced> submaps_;
  std::map<std::int64_t, graph_update_t> updates_;
  std::set<std::int64_t> graphs_;
  std::set<std::int32_t> vertices_;
  std::vector<std::string> contradictions_;
  Solution solution_;
};

}  // namespace seastitch
