#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace seastitch {

// The configuration files that the processes published on CONFIG, by name, such as mapper.yaml: of
// several versions of one file the first. Looks at the first 100,000 events of each log.
std::map<std::string, std::string> RecordedConfig(const std::vector<std::filesystem::path>& logs);

// The logs of one recorder in their order. Files of a dive's log/ are numbered and go by number;
// others by the time of their first event, whatever their names: a shell's order of names is not
// that of recording. Throws std::runtime_error as EventLogReader.
std::vector<std::filesystem::path> InOrderOfRecording(std::vector<std::filesystem::path> logs);

// A dive's folder is one with a dive.json.
bool IsDive(const std::filesystem::path& path);
// Its logs, in order, without those that hold no whole event, which stderr names. Throws
// std::runtime_error where none is left.
std::vector<std::filesystem::path> LogsOfDive(const std::filesystem::path& dive);

}  // namespace seastitch
