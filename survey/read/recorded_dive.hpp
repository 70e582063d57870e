#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/storage/event_log.hpp"
#include "survey/read/message_types.hpp"

namespace seastitch {

// A file of a process's configuration, as it was published on CONFIG.
struct RecordedFile {
  std::string name;  // such as mapper.yaml
  std::string text;
  std::string process;  // such as mapper
  std::string version;  // of the process
  std::int64_t utime = 0;
};

// Content of a dive's logs, found by reading them before the replay.
struct RecordedLogs {
  // One list per recorder, its logs in order; recorders by the time of their first event.
  std::vector<std::vector<LogPart>> recorders;
  // In order, without unchanged repetitions: a file that changed is listed with each version.
  std::vector<RecordedFile> configuration;
  std::map<std::string, RecordedFile> Newest() const;  // by name
  // Types of all events.
  MessageTypes types;
  std::set<std::string> senders;  // "CHANNEL/sender"
  // Files that changed during the dive, with their number of versions.
  std::map<std::string, int> Changed() const;
};

// Reads the logs completely and orders those of one recorder by the sequence numbers of their
// messages, since file names and clocks may be wrong. A file that was joined from logs in the wrong
// order is taken apart where both the numbers and the time of the recorder go back. Where every
// sender restarted: by the numbers of the files in one folder, then by time. Throws
// std::runtime_error as EventLogReader.
RecordedLogs ScanLogs(const std::vector<std::filesystem::path>& logs, bool quiet);

// True for a folder with a dive.json.
bool IsDive(const std::filesystem::path& path);
// Logs of a dive. Logs without a complete event are left out and named on stderr. raw: with the
// logs of the devices' bytes. Throws std::runtime_error where none is left.
std::vector<std::filesystem::path> LogsOfDive(const std::filesystem::path& dive, bool raw = false);

}  // namespace seastitch
