#include "tools/info.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "common/convert/channels.hpp"
#include "common/core/time.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "common/storage/event_log.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/progress.hpp"
#include "survey/read/log_figures.hpp"
#include "survey/read/message_types.hpp"
#include "survey/read/recorded_dive.hpp"
#include "survey/replay/finished_map.hpp"
#include "tools/map_info.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t kLarge = 100'000'000;  // size [bytes] from which progress is shown

// A damaged log: its bytes that belong to no complete event.
struct Tears {
  std::int64_t places = 0;
  std::int64_t bytes = 0;
};

// The logs of one recorder in order, perhaps parts of a file, and what they contain.
struct Record {
  std::vector<LogPart> logs;
  LogFigures figures;
  Tears tears;
};

std::string Utc(std::int64_t utime) {
  const std::string second = UtcText(FromUtime(utime), "%Y-%m-%dT%H:%M:%S");
  char fraction[8];
  std::snprintf(
      fraction, sizeof fraction, ".%03dZ", static_cast<int>((utime / 1000 % 1000 + 1000) % 1000));
  return second + fraction;
}

double Seconds(std::int64_t us) { return static_cast<double>(us) * 1e-6; }

std::uint64_t BytesOf(const std::vector<fs::path>& logs) {
  std::uint64_t bytes = 0;
  for (const fs::path& log : logs) bytes += fs::file_size(log);
  return bytes;
}

Record Read(const std::vector<LogPart>& logs, EventLogWriter* repaired) {
  Record record;
  record.logs = logs;
  std::uint64_t bytes = 0;
  for (const LogPart& log : logs) bytes += log.Size();
  ProgressLine progress("reading", bytes, bytes < kLarge);
  for (const LogPart& log : logs) {
    EventLogReader reader(log);
    while (const auto event = reader.Next()) {
      progress.Advance(SizeInLog(*event));
      record.figures.Add(*event);
      if (repaired != nullptr)
        repaired->Write(event->utime, event->channel, event->data.data(), event->data.size());
    }
    record.tears.places += reader.tears();
    record.tears.bytes += reader.damaged_bytes();
  }
  progress.Finish();
  return record;
}

// ---- text

void PrintChannel(const std::string& name, const std::string& sender, const SenderFigures& f) {
  std::printf("%-16s %-14s %9lld %10.3f %10.2f %10.3f %7lld %7lld\n",
              name.c_str(),
              sender.c_str(),
              static_cast<long long>(f.events),
              static_cast<double>(f.bytes) * 1e-6,
              f.rate_hz(),
              Seconds(f.longest_gap_us),
              static_cast<long long>(f.lost),
              static_cast<long long>(f.undecodable));
}

std::string StepsText(const std::vector<ClockStep>& steps, bool forward) {
  std::int64_t number = 0;
  ClockStep largest;
  for (const ClockStep& step : steps) {
    if ((step.step_us > 0) != forward) continue;
    ++number;
    if (std::abs(Seconds(step.step_us)) > std::abs(Seconds(largest.step_us))) largest = step;
  }
  if (number == 0) return "none";
  char text[96];
  std::snprintf(text,
                sizeof text,
                "%lld, largest %.3f s after %s",
                static_cast<long long>(number),
                Seconds(largest.step_us),
                Utc(largest.utime).c_str());
  return text;
}

void PrintText(const Record& record) {
  for (const LogPart& log : record.logs) std::printf("%s\n", log.path.c_str());
  std::printf("%-16s %-14s %9s %10s %10s %10s %7s %7s\n",
              "channel",
              "sender",
              "events",
              "MB",
              "rate Hz",
              "gap s",
              "lost",
              "bad");
  for (const auto& [name, senders] : record.figures.channels())
    for (const auto& [sender, figures] : senders) PrintChannel(name, sender, figures);
  const LogFigures& f = record.figures;
  std::printf("start %s, end %s, duration %.3f s, %lld events\n",
              Utc(f.first_utime()).c_str(),
              Utc(f.last_utime()).c_str(),
              Seconds(f.last_utime()) - Seconds(f.first_utime()),
              static_cast<long long>(f.events()));
  std::printf("clock steps back: %s\n", StepsText(f.clock_steps(), false).c_str());
  std::printf("clock steps forward: %s\n", StepsText(f.clock_steps(), true).c_str());
  std::printf("torn places: %lld, damaged bytes %lld\n",
              static_cast<long long>(record.tears.places),
              static_cast<long long>(record.tears.bytes));
}

void PrintConfiguration(const RecordedLogs& logs) {
  if (logs.configuration.empty()) std::printf("no configuration inside: a replay needs --config\n");
  const std::map<std::string, int> changed = logs.Changed();
  for (const auto& [name, file] : logs.Newest())
    std::printf("%s of %s %s, sent %s%s\n",
                name.c_str(),
                file.process.c_str(),
                file.version.c_str(),
                Utc(file.utime).c_str(),
                changed.contains(name)
                    ? (", " + std::to_string(changed.at(name)) + " versions").c_str()
                    : "");
}

// ---- JSON

Json ToJson(const SenderFigures& f) {
  return {{"events", f.events},
          {"bytes", f.bytes},
          {"rate_hz", f.rate_hz()},
          {"first_utime", f.first_utime},
          {"last_utime", f.last_utime},
          {"longest_gap_s", Seconds(f.longest_gap_us)},
          {"clock_steps_back", f.clock_steps_back},
          {"lost", f.lost},
          {"undecodable", f.undecodable}};
}

Json ToJson(const Record& record) {
  Json json;
  for (const LogPart& log : record.logs) json["logs"].push_back(log.path.string());
  json["start"] = Utc(record.figures.first_utime());
  json["end"] = Utc(record.figures.last_utime());
  json["events"] = record.figures.events();
  json["damaged_bytes"] = record.tears.bytes;
  json["torn_places"] = record.tears.places;
  json["clock_steps"] = Json::array();
  for (const ClockStep& step : record.figures.clock_steps())
    json["clock_steps"].push_back({{"utime", step.utime}, {"step_s", Seconds(step.step_us)}});
  for (const auto& [name, senders] : record.figures.channels()) {
    json["channels"][name] = ToJson(Total(senders));
    for (const auto& [sender, figures] : senders)
      if (!sender.empty()) json["channels"][name]["senders"][sender] = ToJson(figures);
  }
  return json;
}

Json ConfigurationJson(const RecordedLogs& logs) {
  Json json = Json::array();
  for (const RecordedFile& file : logs.configuration)
    json.push_back({{"name", file.name},
                    {"process", file.process},
                    {"version", file.version},
                    {"utime", file.utime}});
  return json;
}

Json UnreadableJson(const MessageTypes& types) {
  Json json = Json::array();
  for (const MessageTypes::Unreadable& unreadable : types.UnreadableChannels())
    json.push_back({{"channel", unreadable.channel->name},
                    {"fingerprint", FingerprintText(unreadable.fingerprint)},
                    {"expected", unreadable.channel->type}});
  return json;
}

// With one recorder, the usual case, its values are at the top level.
void PrintJson(const RecordedLogs& logs, const std::vector<Record>& records) {
  Json json;
  if (records.size() == 1)
    json = ToJson(records[0]);
  else
    for (const Record& record : records) json["recorders"].push_back(ToJson(record));
  json["configuration"] = ConfigurationJson(logs);
  json["unreadable"] = UnreadableJson(logs.types);
  std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

void Print(const RecordedLogs& logs, const std::vector<Record>& records) {
  for (const Record& record : records) PrintText(record);
  PrintConfiguration(logs);
  for (const MessageTypes::Unreadable& unreadable : logs.types.UnreadableChannels())
    std::printf("%s\n", ToString(unreadable).c_str());
}

// A survey file, or a folder of some that is no dive of the logger.
bool HoldsSurveyFiles(const fs::path& input) {
  if (!fs::is_directory(input)) return SurveyFiles::IsSurveyFile(input);
  if (IsDive(input)) return false;
  return std::any_of(fs::directory_iterator(input), fs::directory_iterator(), [](const auto& file) {
    return file.is_regular_file() && SurveyFiles::IsSurveyFile(file.path());
  });
}

void Finish(EventLogWriter* repaired, const fs::path& path) {
  repaired->Sync();
  SyncFolder(fs::absolute(path).parent_path());
}

}  // namespace

int RunInfo(const InfoOptions& options) {
  if (options.inputs.size() == 1 && IsFinishedMap(options.inputs[0])) {
    if (options.repair_to) throw UsageError("info: --repair takes a log");
    PrintMap(options.inputs[0], options.json);
    return EXIT_SUCCESS;
  }
  if (std::all_of(options.inputs.begin(), options.inputs.end(), HoldsSurveyFiles)) {
    if (options.repair_to) throw UsageError("info: --repair takes a log");
    PrintSurvey(options.inputs, options.json);
    return EXIT_SUCCESS;
  }
  for (const fs::path& input : options.inputs)
    if (fs::is_directory(input) && !IsDive(input))
      throw UsageError(
          input.string() +
          ": a folder without a map, a dive or survey files; info takes logs, a dive's "
          "folder, a map or survey files");
  std::vector<fs::path> inputs = options.inputs;
  if (inputs.size() == 1 && IsDive(inputs[0])) inputs = LogsOfDive(inputs[0]);
  if (options.repair_to && inputs.size() > 1)
    throw UsageError("info: --repair takes one log at a time");
  if (options.repair_to && fs::exists(*options.repair_to))
    throw UsageError(options.repair_to->string() + ": exists already");
  const RecordedLogs logs = ScanLogs(inputs, BytesOf(inputs) < kLarge);
  std::optional<EventLogWriter> repaired;
  if (options.repair_to) repaired.emplace(*options.repair_to, IfExists::kRefuse);
  std::vector<Record> records;
  for (const auto& recorder : logs.recorders)
    records.push_back(Read(recorder, repaired ? &*repaired : nullptr));
  if (repaired) Finish(&*repaired, *options.repair_to);
  if (options.json)
    PrintJson(logs, records);
  else
    Print(logs, records);
  return EXIT_SUCCESS;
}

}  // namespace seastitch
