#include "page/process_roll.hpp"

#include <algorithm>
#include <limits>

namespace seastitch {
namespace {

constexpr double kLatelyS = 3.0;       // HEALTH is sent once a second
constexpr std::int64_t kMaxLost = 10;  // consecutive messages of one program
// Names and programs that are kept: a bus may carry any number of them.
constexpr std::size_t kMaxNames = 60;
constexpr std::size_t kMaxPrograms = 20;

}  // namespace

void ProcessRoll::Add(const health_t& msg, double now_s) {
  if (!entries_.contains(msg.process) && entries_.size() >= kMaxNames) {
    // In place of the one that is silent for longest; ours stay.
    auto oldest = entries_.end();
    for (auto it = entries_.begin(); it != entries_.end(); ++it)
      if (!IsOurs(it->first) &&
          (oldest == entries_.end() || it->second.heard_s < oldest->second.heard_s))
        oldest = it;
    if (oldest != entries_.end()) entries_.erase(oldest);
  }
  Entry& entry = entries_[msg.process];
  entry.last = msg;
  entry.heard_s = now_s;
  std::erase_if(entry.programs, [&](const Program& p) { return now_s - p.last_s > kLatelyS; });
  // The program whose sequence number comes next; of two, the nearer.
  Program* its = nullptr;
  for (Program& program : entry.programs) {
    const bool follows = msg.seq > program.seq && msg.seq - program.seq <= kMaxLost;
    if (follows && (its == nullptr || program.seq > its->seq)) its = &program;
  }
  if (its == nullptr && entry.programs.size() >= kMaxPrograms)
    entry.programs.erase(entry.programs.begin());
  if (its == nullptr)
    its = &entry.programs.emplace_back(Program{.seq = 0, .first_s = now_s, .last_s = now_s});
  its->seq = msg.seq;
  its->last_s = now_s;
}

const health_t* ProcessRoll::Find(const std::string& process) const {
  const auto found = entries_.find(process);
  return found == entries_.end() ? nullptr : &found->second.last;
}

double ProcessRoll::SilentFor(const std::string& process, double now_s) const {
  const auto found = entries_.find(process);
  return found == entries_.end() ? std::numeric_limits<double>::infinity()
                                 : now_s - found->second.heard_s;
}

bool ProcessRoll::IsTwice(const std::string& process, double now_s) const {
  const auto found = entries_.find(process);
  if (found == entries_.end()) return false;
  // After a restart the old program sends no more.
  const std::vector<Program>& programs = found->second.programs;
  for (std::size_t i = 1; i < programs.size(); ++i)
    if (now_s - programs[i].last_s <= kLatelyS && programs[i - 1].last_s > programs[i].first_s)
      return true;
  return false;
}

std::vector<std::string> ProcessRoll::names() const {
  std::vector<std::string> all(kProcesses.begin(), kProcesses.end());
  for (const auto& [name, entry] : entries_)
    if (std::find(all.begin(), all.end(), name) == all.end()) all.push_back(name);
  return all;
}

bool IsOptional(const std::string& process) {
  return std::find(kOptionalProcesses.begin(), kOptionalProcesses.end(), process) !=
         kOptionalProcesses.end();
}

bool IsOurs(const std::string& process) {
  return IsOptional(process) ||
         std::find(kProcesses.begin(), kProcesses.end(), process) != kProcesses.end();
}

}  // namespace seastitch
