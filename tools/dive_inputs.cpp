#include "tools/dive_inputs.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <stdexcept>

#include "products/navigation_files.hpp"
#include "tools/recorded_dive.hpp"
#include "tools/sbet_beside.hpp"
#include "tools/survey_files.hpp"
#include "tools/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr char kLogs[] = "logs";  // name of the dive of logs that are not in a dive's folder

std::vector<fs::path> FilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (!entry.is_regular_file()) continue;
    if (path.extension() == ".lcmlog" || SurveyFiles::IsSurveyFile(path)) files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Date of a file, such as 2026-05-02.
std::string DayOf(const fs::path& file) {
  const std::optional<Time> first = SurveyStream(file, SurveyFiles::kReorderS).next();
  return first ? IsoTime(*first).substr(0, 10) : std::string("without records");
}

std::string NameOf(const fs::path& path) {
  return (fs::weakly_canonical(path) / "").parent_path().filename().string();
}

DiveInput DiveIn(const fs::path& folder, bool raw) {
  DiveInput dive{NameOf(folder), {}, folder};
  try {
    dive.files = IsDive(folder) ? LogsOfDive(folder, raw) : FilesIn(folder);
  } catch (const std::runtime_error& e) {  // of several dives the others are mapped
    dive.problem = e.what();
  }
  return dive;
}

}  // namespace

std::vector<DiveInput> DivesAmong(const std::vector<fs::path>& inputs, bool raw) {
  std::vector<DiveInput> dives;
  std::map<std::string, std::size_t> loose;  // index of the dive in `dives`, by day or kLogs
  std::vector<fs::path> beside;              // navigation files for all dives in their time span
  for (const fs::path& input : inputs) {
    if (!fs::is_directory(input) && IsNavigationBeside(input)) {
      beside.push_back(input);
      continue;
    }
    if (fs::is_directory(input)) {
      dives.push_back(DiveIn(input, raw));
      continue;
    }
    const std::string group = SurveyFiles::IsSurveyFile(input) ? DayOf(input) : kLogs;
    const auto [place, is_new] = loose.try_emplace(group, dives.size());
    if (is_new) dives.push_back({group, {}});
    dives[place->second].files.push_back(input);
  }
  for (const auto& [group, place] : loose)
    if (group != kLogs)
      dives[place].files.insert(dives[place].files.end(), beside.begin(), beside.end());
  if (dives.empty() && !beside.empty()) dives.push_back({beside[0].filename().string(), beside});
  std::set<std::string> names;
  for (DiveInput& dive : dives) {
    const std::string name = dive.name;
    for (int n = 2; !names.insert(dive.name).second; ++n)
      dive.name = name + " (" + std::to_string(n) + ")";
  }
  return dives;
}

}  // namespace seastitch
