#include "tools/recorded_dive.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr int kFirstEvents = 100'000;

std::optional<config_t> Decode(const LogEvent& event) {
  if (event.channel != channels::kConfig) return std::nullopt;
  config_t msg{};
  const int size = static_cast<int>(event.data.size());
  return msg.decode(event.data.data(), 0, size) == size ? std::optional(msg) : std::nullopt;
}

// Of 012.lcmlog: 12.
std::optional<int> NumberOf(const fs::path& file) {
  const std::string stem = file.stem().string();
  int number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  const bool is_number = error == std::errc() && end == stem.data() + stem.size();
  return is_number ? std::optional(number) : std::nullopt;
}

std::int64_t FirstUtime(const fs::path& log) { return EventLogReader(log).Next().value().utime; }

// A logger that was killed at once leaves a file without a whole event.
bool HoldsAnEvent(const fs::path& log) {
  try {
    EventLogReader reader(log);
    return true;
  } catch (const std::runtime_error& e) {
    std::fprintf(stderr, "%s: skipped\n", e.what());
    return false;
  }
}

template <class Key>
std::vector<fs::path> SortedBy(std::vector<fs::path> logs, Key key_of) {
  std::vector<std::pair<decltype(key_of(logs[0])), fs::path>> keyed;
  for (fs::path& log : logs) {
    auto key = key_of(log);
    keyed.emplace_back(std::move(key), std::move(log));
  }
  std::sort(keyed.begin(), keyed.end());
  logs.clear();
  for (auto& [key, log] : keyed) logs.push_back(std::move(log));
  return logs;
}

}  // namespace

std::map<std::string, std::string> RecordedConfig(const std::vector<fs::path>& logs) {
  std::map<std::string, std::string> files;
  for (const fs::path& log : logs) {
    EventLogReader reader(log);
    ConfigAssembler assembler;
    for (int events = 0; events < kFirstEvents; ++events) {
      const std::optional<LogEvent> event = reader.Next();
      if (!event) break;
      const std::optional<config_t> part = Decode(*event);
      if (!part) continue;
      if (const auto file = assembler.Add(*part)) files.emplace(file->name, file->text);
    }
  }
  return files;
}

std::vector<fs::path> InOrderOfRecording(std::vector<fs::path> logs) {
  if (logs.size() < 2) return logs;
  const bool of_one_dive = std::all_of(logs.begin(), logs.end(), [&](const fs::path& log) {
    return NumberOf(log) && log.parent_path() == logs[0].parent_path();
  });
  if (of_one_dive)
    return SortedBy(std::move(logs), [](const fs::path& log) { return NumberOf(log).value(); });
  return SortedBy(std::move(logs), FirstUtime);
}

bool IsDive(const fs::path& path) { return fs::exists(path / "dive.json"); }

std::vector<fs::path> LogsOfDive(const fs::path& dive) {
  std::vector<fs::path> logs;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(dive / "log", none))
    if (entry.path().extension() == ".lcmlog" && HoldsAnEvent(entry.path()))
      logs.push_back(entry.path());
  if (logs.empty()) throw std::runtime_error(dive.string() + ": holds no log");
  return InOrderOfRecording(std::move(logs));
}

}  // namespace seastitch
