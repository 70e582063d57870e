#include "survey/plan/dive_inputs.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <variant>

#include "products/files/navigation_files.hpp"
#include "survey/errors.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/recorded_dive.hpp"
#include "survey/read/sbet_beside.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr char kLogs[] = "logs";  // name of the dive of logs that are not in a dive's folder

// Why a file is neither a log nor a survey file.
const char* ForeignText(const fs::path& path) {
  return fs::file_size(path) == 0 ? "empty" : "neither a log nor a survey file of a known format";
}

void NameForeign(const std::vector<fs::path>& files) {
  for (const fs::path& path : files)
    std::fprintf(stderr, "not used: %s: %s\n", path.c_str(), ForeignText(path));
}

bool IsLog(const fs::path& path) {
  constexpr std::array<char, 4> kSync{'\xED', '\xA1', '\xDA', '\x01'};
  std::array<char, 4> begin{};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  return path.extension() == ".lcmlog" || begin == kSync;
}

// Logs and survey files of a folder; none: a folder of submaps. Other files are named on stderr,
// but for descriptions of columns.
std::vector<fs::path> FilesIn(const fs::path& folder) {
  std::vector<fs::path> files, others;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (!entry.is_regular_file() || path.extension() == ".yaml") continue;
    const bool known = path.extension() == ".lcmlog" || SurveyFiles::IsSurveyFile(path);
    (known ? files : others).push_back(path);
  }
  std::sort(files.begin(), files.end());
  std::sort(others.begin(), others.end());
  if (files.empty()) return files;
  NameForeign(others);
  return files;
}

// Date of the first ping or navigation record, such as 2026-05-02. A profile may be of another day.
std::string DayOf(const fs::path& file) {
  if (IsLineFile(file)) {
    const std::optional<Time> first = FirstTimeOf(file);
    return first ? IsoTime(*first).substr(0, 10) : "lines";
  }
  for (SurveyStream stream(file, SurveyFiles::kReorderS); stream.next();) {
    const SurveyRecord record = stream.Take();
    if (std::holds_alternative<MbesPing>(record) || std::holds_alternative<PlacedPing>(record) ||
        std::holds_alternative<NavigationRecord>(record))
      return IsoTime(TimeOf(record)).substr(0, 10);
  }
  return "without pings";
}

std::string NameOf(const fs::path& path) {
  return (fs::weakly_canonical(path) / "").parent_path().filename().string();
}

bool IsOfSurveyFiles(const DiveInput& dive) {
  return !dive.files.empty() &&
         std::all_of(dive.files.begin(), dive.files.end(), SurveyFiles::IsSurveyFile);
}

// Adds navigation files to every dive of survey files: they apply where they have records.
void AddBeside(const std::vector<fs::path>& beside, std::vector<DiveInput>* dives) {
  if (beside.empty()) return;
  if (dives->empty()) return dives->push_back({beside[0].filename().string(), beside});
  bool any = false;
  for (DiveInput& dive : *dives) {
    if (!IsOfSurveyFiles(dive)) continue;
    dive.files.insert(dive.files.end(), beside.begin(), beside.end());
    any = true;
  }
  if (!any)
    throw UsageError("replay: " + beside[0].string() +
                     ": navigation beside survey files, but no input has any");
}

// Refuses files that are given twice, also by another name or within a folder.
void ExpectOnce(const std::vector<DiveInput>& dives, const std::vector<fs::path>& beside) {
  std::set<fs::path> seen;
  const auto expect_new = [&seen](const fs::path& file) {
    if (!seen.insert(fs::canonical(file)).second)
      throw UsageError("replay: " + file.string() + ": given twice");
  };
  for (const DiveInput& dive : dives)
    if (IsOfSurveyFiles(dive)) std::for_each(dive.files.begin(), dive.files.end(), expect_new);
  std::for_each(beside.begin(), beside.end(), expect_new);
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
  std::vector<fs::path> beside, empty;
  for (const fs::path& input : inputs) {
    if (!fs::is_directory(input) && IsNavigationBeside(input)) {
      beside.push_back(input);
      continue;
    }
    if (fs::is_directory(input)) {
      dives.push_back(DiveIn(input, raw));
      continue;
    }
    const bool survey = SurveyFiles::IsSurveyFile(input);
    if (!survey && !IsLog(input)) {
      if (fs::file_size(input) > 0) throw DataError(input.string() + ": " + ForeignText(input));
      empty.push_back(input);
      continue;
    }
    const std::string group = survey ? DayOf(input) : kLogs;
    const auto [place, is_new] = loose.try_emplace(group, dives.size());
    if (is_new) dives.push_back({group, {}});
    dives[place->second].files.push_back(input);
  }
  if (dives.empty() && !empty.empty())
    throw DataError(empty[0].string() + ": " + ForeignText(empty[0]));
  NameForeign(empty);
  ExpectOnce(dives, beside);
  AddBeside(beside, &dives);
  std::set<std::string> names;
  for (DiveInput& dive : dives) {
    const std::string name = dive.name;
    for (int n = 2; !names.insert(dive.name).second; ++n)
      dive.name = name + " (" + std::to_string(n) + ")";
  }
  return dives;
}

}  // namespace seastitch
