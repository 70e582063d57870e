#include "tests/kill/recorded_kills.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "common/convert/channels.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/storage/submap_file.hpp"
#include "page/process_roll.hpp"
#include "seastitch/graph_request_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "seastitch/submap_t.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Input that a process alone reads, or alone makes from its device.
const std::map<std::string, std::set<std::string>> kInputs{
    {"imu-driver", {channels::kImu}},
    {"dvl-driver", {channels::kDvl, channels::kDepth}},
    {"mbes-driver", {channels::kMbesPing, channels::kSvp}},
    {"mapper",
     {channels::kImu,
      channels::kDvl,
      channels::kDepth,
      channels::kMbesPing,
      channels::kSvp,
      channels::kPositionFix}}};

// Of which a process is at work again. Of the logger: what it wrote.
const std::map<std::string, std::string> kOutputOf{{channels::kImu, "imu-driver"},
                                                   {channels::kDvl, "dvl-driver"},
                                                   {channels::kMbesPing, "mbes-driver"},
                                                   {channels::kNav, "mapper"},
                                                   {channels::kPoseGraph, "optimizer"}};

template <class Msg>
Msg Decoded(const LogEvent& event) {
  Msg msg;
  if (msg.decode(event.data.data(), 0, static_cast<int>(event.data.size())) < 0)
    throw std::runtime_error("an unreadable message of " + event.channel);
  return msg;
}

template <class Msg>
std::vector<std::uint8_t> WithoutNumber(Msg msg) {
  msg.seq = 0;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// Every submap's file, by its number; nothing for one that cannot be read.
std::set<std::int32_t> StoredIn(const fs::path& map) {
  std::set<std::int32_t> stored;
  for (const auto& entry : fs::recursive_directory_iterator(map)) {
    int id = 0;
    char rest = 0;
    const std::string name = entry.path().filename().string();
    if (std::sscanf(name.c_str(), "submap_%d.pc%c", &id, &rest) != 2 || rest != 'd') continue;
    if (!ReadSubmapPcd(entry.path()).cloud.empty()) stored.insert(id);
  }
  return stored;
}

std::string Numbers(const std::set<std::int32_t>& numbers) {
  std::string text;
  for (const std::int32_t number : numbers) text += " " + std::to_string(number);
  return text;
}

std::set<std::int32_t> Missing(const std::set<std::int32_t>& all,
                               const std::set<std::int32_t>& there) {
  std::set<std::int32_t> missing;
  std::set_difference(
      all.begin(), all.end(), there.begin(), there.end(), std::inserter(missing, missing.end()));
  return missing;
}

}  // namespace

std::vector<fs::path> LogsIn(const fs::path& folder) {
  std::vector<fs::path> logs;
  for (const auto& entry : fs::directory_iterator(folder))
    if (LogNumber(entry.path())) logs.push_back(entry.path());
  std::sort(logs.begin(), logs.end());
  return logs;
}

RecordedKills::RecordedKills(std::vector<Kill> kills, const fs::path& log, const fs::path& dive)
    : kills_(std::move(kills)), dive_(dive) {
  for (const fs::path& file : LogsIn(log)) Read(file);
  for (const fs::path& file : LogsIn(dive / "log")) {
    EventLogReader reader(file);
    while (const auto event = reader.Next()) outputs_["logger"].insert(event->utime);
  }
  FindBack();
}

void RecordedKills::Read(const fs::path& log) {
  EventLogReader reader(log);
  while (const std::optional<LogEvent> event = reader.Next()) Use(*event);
}

void RecordedKills::Use(const LogEvent& event) {
  const auto output = kOutputOf.find(event.channel);
  if (output != kOutputOf.end()) outputs_[output->second].insert(event.utime);
  // On the bus the page has no other output.
  if (event.channel == channels::kHealth && Decoded<health_t>(event).process == kPage)
    outputs_[kPage].insert(event.utime);
  if (event.channel == channels::kSubmap) {
    const auto submap = Decoded<submap_t>(event);
    Announced& announced = submaps_[submap.id];
    // A mapper that goes on announces its last one again.
    if (announced.starts.empty()) announced.announced_utime = event.utime;
    announced.starts.insert(submap.utime);
    announced.end_utime = submap.end_utime;
  } else if (event.channel == channels::kGraphUpdate) {
    auto update = Decoded<graph_update_t>(event);
    graphs_.insert(update.graph_id);
    for (const graph_vertex_t& vertex : update.vertices) vertices_.insert(vertex.id);
    const auto [known, is_new] = updates_.try_emplace(update.version, update);
    if (!is_new && WithoutNumber(known->second) != WithoutNumber(update))
      contradictions_.push_back("version " + std::to_string(update.version) +
                                " of the graph was sent with two contents");
    if (!first_update_utime_) first_update_utime_ = event.utime;
  } else if (event.channel == channels::kGraphRequest) {
    if (Decoded<graph_request_t>(event).sender == "optimizer") requests_.insert(event.utime);
  } else if (event.channel == channels::kPoseGraph) {
    const auto part = Decoded<pose_graph_t>(event);
    if (part.part == 0) solution_ = {part.graph_version, part.solution_number, 0};
    solution_.vertices += static_cast<std::size_t>(part.num_vertices);
  }
}

// Before the first submap an optimizer has nothing to solve: then it is back when it asks for the
// graph.
void RecordedKills::FindBack() {
  for (Kill& kill : kills_) {
    const bool solves = first_update_utime_ && *first_update_utime_ < ToUtime(kill.at);
    const std::set<std::int64_t>& outputs =
        kill.process == "optimizer" && !solves ? requests_ : outputs_[kill.process];
    const auto first = outputs.upper_bound(ToUtime(kill.restarted));
    if (first != outputs.end()) kill.back = FromUtime(*first);
  }
}

std::vector<std::string> RecordedKills::Losses() const {
  std::vector<std::string> losses = contradictions_;
  std::set<std::int32_t> announced;
  for (const auto& [id, submap] : submaps_) {
    announced.insert(id);
    if (submap.starts.size() > 1)
      losses.push_back("submap " + std::to_string(id) + " was two different ones");
  }
  if (announced.empty()) losses.emplace_back("no submap closed");
  if (const auto missing = Missing(announced, vertices_); !missing.empty())
    losses.push_back("closed submaps that are not in the graph:" + Numbers(missing));
  if (const auto missing = Missing(announced, StoredIn(dive_ / "map")); !missing.empty())
    losses.push_back("closed submaps without a file that can be read:" + Numbers(missing));
  if (solution_.vertices != announced.size())
    losses.push_back("the last solution has " + std::to_string(solution_.vertices) + " of " +
                     std::to_string(announced.size()) + " submaps");
  const std::int64_t newest = updates_.empty() ? 0 : updates_.rbegin()->first;
  if (solution_.version != newest)
    losses.push_back("the last solution is of version " + std::to_string(solution_.version) +
                     ", the graph's last is " + std::to_string(newest));
  if (static_cast<std::int64_t>(updates_.size()) != newest)
    losses.push_back("versions of the graph have holes");
  if (graphs_.size() != 1)
    losses.push_back(std::to_string(graphs_.size()) + " graphs in place of one");
  if (fs::exists(dive_ / "map-2")) losses.emplace_back("the mapper began another map: map-2");
  return losses;
}

std::int64_t RecordedKills::LastSubmapEnd(Time before) const {
  std::int64_t end = 0;
  for (const auto& [id, submap] : submaps_)
    if (submap.announced_utime <= ToUtime(before)) end = std::max(end, submap.end_utime);
  return end;
}

bool RecordedKills::Lost(const LogEvent& event, const Kill& kill) const {
  const auto inputs = kInputs.find(kill.process);
  if (inputs == kInputs.end() || !inputs->second.contains(event.channel)) return false;
  const std::int64_t at = ToUtime(kill.at);
  if (event.utime >= at && kill.back && event.utime < ToUtime(*kill.back)) return true;
  return kill.process == "mapper" && event.channel == channels::kMbesPing && event.utime < at &&
         event.utime > LastSubmapEnd(kill.at);
}

void RecordedKills::Cut(const fs::path& whole, const fs::path& cut) const {
  EventLogReader reader(whole);
  EventLogWriter writer(cut);
  while (const std::optional<LogEvent> event = reader.Next()) {
    const bool lost = std::any_of(
        kills_.begin(), kills_.end(), [&](const Kill& kill) { return Lost(*event, kill); });
    if (!lost) writer.Write(event->utime, event->channel, event->data.data(), event->data.size());
  }
}

}  // namespace seastitch
