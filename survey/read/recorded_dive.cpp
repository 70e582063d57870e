#include "survey/read/recorded_dive.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/storage/event_log.hpp"
#include "survey/progress.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// What a first pass over a log finds.
struct Scan {
  LogPart log;
  std::int64_t events = 0;
  std::int64_t first_utime = 0;
  std::int64_t last_utime = 0;
  // Sequence numbers of the first and the last message, by channel and sender.
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> numbers{};
  std::vector<config_t> configuration{};  // in parts: the rest of a file may be in the next log
};

std::optional<config_t> Decode(const LogEvent& event) {
  if (event.channel != channels::kConfig) return std::nullopt;
  config_t msg{};
  const int size = static_cast<int>(event.data.size());
  return msg.decode(event.data.data(), 0, size) == size ? std::optional(msg) : std::nullopt;
}

void Add(const LogEvent& event, Scan* scan) {
  if (scan->events++ == 0) scan->first_utime = event.utime;
  scan->last_utime = event.utime;
  if (const auto place = PlaceOf(event.data)) {
    const auto [found, is_first] = scan->numbers.try_emplace(event.channel + "/" + place->sender,
                                                             std::pair(place->seq, place->seq));
    if (!is_first) found->second.second = place->seq;
  }
  if (auto part = Decode(event)) scan->configuration.push_back(std::move(*part));
}

// Senders whose numbers continue from one scan to the next, minus senders whose numbers went back.
int Votes(const Scan& a, const Scan& b) {
  int votes = 0;
  for (const auto& [sender, of_b] : b.numbers)
    if (const auto of_a = a.numbers.find(sender); of_a != a.numbers.end())
      votes += of_b.first > of_a->second.second ? 1 : -1;
  return votes;
}

// What follows a step back in time, as part of the scan before.
void Append(Scan next, Scan* scan) {
  scan->events += next.events;
  scan->last_utime = next.last_utime;
  for (const auto& [sender, numbers] : next.numbers)
    scan->numbers.try_emplace(sender, numbers).first->second.second = numbers.second;
  std::move(next.configuration.begin(),
            next.configuration.end(),
            std::back_inserter(scan->configuration));
}

// The parts of a log: one, unless its time goes back and the numbers of most senders with it.
std::vector<Scan> ScanLog(const fs::path& log, MessageTypes* types, bool quiet) {
  constexpr std::int64_t kBackUs = 1'000'000;
  constexpr std::int64_t kFewest = 10;  // events that show a part: one that is damaged shows none
  EventLogReader reader(log, [](const std::string& channel) {
    return channel == channels::kConfig ? std::numeric_limits<std::size_t>::max() : kBytesOfPlace;
  });
  ProgressLine progress("looking through " + log.filename().string(), fs::file_size(log), quiet);
  std::vector<Scan> parts{Scan{log}};
  std::optional<Scan> next;  // after a step back
  const auto settle = [&] {
    if (next->events >= kFewest && Votes(parts.back(), *next) < 0) {
      parts.back().log.end = next->log.begin;
      parts.push_back(std::move(*next));
    } else {
      Append(std::move(*next), &parts.back());
    }
    next.reset();
  };
  while (const auto event = reader.Next()) {
    progress.Advance(SizeInLog(*event));
    types->Add(*event);
    if (!next && parts.back().events > 0 && event->utime < parts.back().last_utime - kBackUs)
      next = Scan{{log, reader.position() - SizeInLog(*event), UINT64_MAX}};
    Add(*event, next ? &*next : &parts.back());
    if (next && next->events == kFewest) settle();
  }
  if (next) settle();
  progress.Finish();
  return parts;
}

// ---- order

using Chain = std::vector<const Scan*>;

// Evidence by sequence numbers that log b was recorded next after log a.
struct Link {
  // smallest number of missing messages of any channel; 0: b continues a without a gap
  std::int64_t missing;
  // of all channels: a rare channel may miss none although a whole log lies between
  std::int64_t missing_in_all;
  const Scan* a;
  const Scan* b;
  bool operator<(const Link& other) const {
    return std::tuple(missing, missing_in_all, b->first_utime) <
           std::tuple(other.missing, other.missing_in_all, other.b->first_utime);
  }
};

std::optional<Link> FindLink(const Scan& a, const Scan& b) {
  if (Votes(a, b) <= 0) return std::nullopt;
  std::optional<std::int64_t> missing;
  std::int64_t missing_in_all = 0;
  for (const auto& [sender, of_b] : b.numbers) {
    const auto of_a = a.numbers.find(sender);
    if (of_a == a.numbers.end() || of_b.first <= of_a->second.second) continue;
    const std::int64_t between = of_b.first - of_a->second.second - 1;
    missing = std::min(missing.value_or(between), between);
    missing_in_all += between;
  }
  // If messages are missing, b may belong to another dive or be older than a restart of all
  // senders: then times and log numbers must not contradict the order.
  const bool against_names = a.log.path.parent_path() == b.log.path.parent_path() &&
                             LogNumber(a.log.path) && LogNumber(b.log.path) &&
                             *LogNumber(b.log.path) < *LogNumber(a.log.path);
  if (*missing > 0 && (b.first_utime < a.last_utime || against_names)) return std::nullopt;
  return Link{*missing, missing_in_all, &a, &b};
}

// Joins logs into chains, closest links first. Each log is used once, and no circle is made.
std::vector<Chain> ChainsOf(const std::vector<Scan>& scans) {
  std::vector<Link> links;
  for (const Scan& a : scans)
    for (const Scan& b : scans)
      if (&a != &b)
        if (const auto link = FindLink(a, b)) links.push_back(*link);
  std::stable_sort(links.begin(), links.end());
  std::map<const Scan*, const Scan*> next;
  std::map<const Scan*, const Scan*> before;
  const auto leads_to = [&](const Scan* from, const Scan* to) {
    while (from != to && next.contains(from)) from = next[from];
    return from == to;
  };
  for (const Link& link : links) {
    if (next.contains(link.a) || before.contains(link.b) || leads_to(link.b, link.a)) continue;
    next[link.a] = link.b;
    before[link.b] = link.a;
  }
  std::vector<Chain> chains;
  for (const Scan& scan : scans) {
    if (before.contains(&scan)) continue;
    Chain& chain = chains.emplace_back(Chain{&scan});
    while (next.contains(chain.back())) chain.push_back(next[chain.back()]);
  }
  return chains;
}

// The folder of a chain of numbered logs; nothing for other chains.
std::optional<fs::path> FolderOfNumbered(const Chain& chain) {
  const fs::path folder = chain.front()->log.path.parent_path();
  const bool numbered = std::all_of(chain.begin(), chain.end(), [&](const Scan* scan) {
    return LogNumber(scan->log.path) && scan->log.path.parent_path() == folder;
  });
  return numbered ? std::optional(folder) : std::nullopt;
}

// Joins the chains of numbered logs in one folder: they are of one recorder.
std::vector<Chain> JoinNumbered(std::vector<Chain> chains) {
  std::stable_sort(chains.begin(), chains.end(), [](const Chain& a, const Chain& b) {
    return LogNumber(a.front()->log.path) < LogNumber(b.front()->log.path);
  });
  std::vector<Chain> joined;
  std::map<fs::path, std::size_t> place_of_folder;
  for (Chain& chain : chains) {
    const auto folder = FolderOfNumbered(chain);
    const auto [place, is_new] = folder ? place_of_folder.try_emplace(*folder, joined.size())
                                        : std::pair(place_of_folder.end(), true);
    if (is_new)
      joined.push_back(std::move(chain));
    else
      joined[place->second].insert(joined[place->second].end(), chain.begin(), chain.end());
  }
  std::stable_sort(joined.begin(), joined.end(), [](const Chain& a, const Chain& b) {
    return a.front()->first_utime < b.front()->first_utime;
  });
  return joined;
}

// ---- configuration

// Configuration files of one recorder in order, without unchanged repetitions.
std::vector<RecordedFile> ConfigurationOf(const Chain& chain) {
  std::vector<RecordedFile> files;
  std::map<std::string, std::string> newest;
  ConfigAssembler assembler;
  for (const Scan* scan : chain)
    for (const config_t& part : scan->configuration) {
      const auto file = assembler.Add(part);
      if (!file) continue;
      const auto [known, is_new] = newest.try_emplace(file->name, file->text);
      if (!is_new && known->second == file->text) continue;
      known->second = file->text;
      files.push_back({file->name, file->text, file->process, file->version, part.utime});
    }
  return files;
}

std::vector<fs::path> LogsIn(const fs::path& folder) {
  std::vector<fs::path> logs;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.path().extension() != ".lcmlog") continue;
    try {
      // a logger that was killed at once leaves an empty log: nothing to read
      EventLogReader reader(entry.path());
      logs.push_back(entry.path());
    } catch (const std::runtime_error& e) {
      std::fprintf(stderr, "%s: skipped\n", e.what());
    }
  }
  std::sort(logs.begin(), logs.end());
  return logs;
}

}  // namespace

std::map<std::string, RecordedFile> RecordedLogs::Newest() const {
  std::map<std::string, RecordedFile> newest;
  for (const RecordedFile& file : configuration) newest.insert_or_assign(file.name, file);
  return newest;
}

std::map<std::string, int> RecordedLogs::Changed() const {
  std::map<std::string, int> versions;
  for (const RecordedFile& file : configuration) ++versions[file.name];
  std::erase_if(versions, [](const auto& file) { return file.second < 2; });
  return versions;
}

RecordedLogs ScanLogs(const std::vector<fs::path>& logs, bool quiet) {
  std::vector<Scan> scans;
  RecordedLogs recorded;
  std::set<fs::path> seen;
  for (const fs::path& log : logs)
    if (seen.insert(fs::weakly_canonical(log)).second)
      for (Scan& part : ScanLog(log, &recorded.types, quiet)) scans.push_back(std::move(part));
  for (const Scan& scan : scans)
    for (const auto& [sender, numbers] : scan.numbers) recorded.senders.insert(sender);
  std::set<std::string> known;
  for (const Chain& chain : JoinNumbered(ChainsOf(scans))) {
    std::vector<LogPart>& parts = recorded.recorders.emplace_back();
    for (const Scan* scan : chain) parts.push_back(scan->log);
    // Another recorder received the same messages: only files that are missing so far are added.
    const std::vector<RecordedFile> files = ConfigurationOf(chain);
    for (const RecordedFile& file : files)
      if (!known.contains(file.name)) recorded.configuration.push_back(file);
    for (const RecordedFile& file : files) known.insert(file.name);
  }
  return recorded;
}

bool IsDive(const fs::path& path) { return fs::exists(path / "dive.json"); }

std::vector<fs::path> LogsOfDive(const fs::path& dive, bool raw) {
  std::vector<fs::path> logs = LogsIn(dive / "log");
  const std::vector<fs::path> of_devices = raw ? LogsIn(dive / "raw") : std::vector<fs::path>();
  logs.insert(logs.end(), of_devices.begin(), of_devices.end());
  if (logs.empty()) throw std::runtime_error(dive.string() + ": holds no log");
  return logs;
}

}  // namespace seastitch
