#include "survey/plan/dive_inputs.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/core/time.hpp"
#include "survey/errors.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/plan/profiles_beside.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/plan/survey_groups.hpp"
#include "survey/read/recorded_dive.hpp"
#include "survey/read/sbet_beside.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr char kLogs[] = "logs";  // name of the dive of logs that are not in a dive's folder

// Why a file is neither a log nor a survey file.
std::string ForeignText(const fs::path& path) {
  if (!std::ifstream(path)) return std::string("cannot be read: ") + std::strerror(errno);
  if (fs::file_size(path) == 0) return "empty";
  for (const char* const packed : {".gz", ".bz2", ".xz", ".zst", ".zip", ".7z", ".tar", ".rar"})
    if (path.extension() == packed) return "packed: unpack it first";
  return "neither a log nor a survey file of a known format";
}

void NameForeign(const std::vector<fs::path>& files) {
  for (const fs::path& path : files)
    std::fprintf(stderr, "not used: %s: %s\n", path.c_str(), ForeignText(path).c_str());
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
  // A survey plan looks for profiles itself.
  if (std::any_of(files.begin(), files.end(), SurveyFiles::IsSurveyFile))
    std::erase_if(others, IsProfileFile);
  std::sort(files.begin(), files.end());
  std::sort(others.begin(), others.end());
  if (files.empty()) return files;
  NameForeign(others);
  return files;
}

// Name of a group of files that were named one by one: the date of its first record.
std::string DayOf(const SurveyGroup& group) {
  if (group.begin) return UtcText(*group.begin, "%Y-%m-%d");
  return IsLineFile(group.files[0]) ? "lines" : "without pings";
}

std::string NameOf(const fs::path& path) {
  return (fs::weakly_canonical(path) / "").parent_path().filename().string();
}

bool IsOfSurveyFiles(const DiveInput& dive) {
  return !dive.files.empty() &&
         std::all_of(dive.files.begin(), dive.files.end(), SurveyFiles::IsSurveyFile);
}

// Refuses files that belong beside survey files where no dive has any. what: such as "navigation".
void ExpectSurveyFiles(const std::vector<DiveInput>& dives,
                       const fs::path& beside,
                       const std::string& what) {
  if (std::none_of(dives.begin(), dives.end(), IsOfSurveyFiles))
    throw UsageError("replay: " + beside.string() + ": " + what +
                     " beside survey files, but no input has any");
}

// Adds navigation files to every dive of survey files: they apply where they have records.
void AddBeside(const std::vector<fs::path>& beside, std::vector<DiveInput>* dives) {
  if (beside.empty()) return;
  if (dives->empty()) return dives->push_back({beside[0].filename().string(), beside});
  ExpectSurveyFiles(*dives, beside[0], "navigation");
  for (DiveInput& dive : *dives)
    if (IsOfSurveyFiles(dive)) dive.files.insert(dive.files.end(), beside.begin(), beside.end());
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

// A group of a folder or, without a folder, of files that were named one by one.
DiveInput DiveOf(SurveyGroup group, const std::string& name) {
  std::string note = group.reason;
  if (!group.sonar.empty()) note = group.sonar + (note.empty() ? "" : "; ") + note;
  return {name, std::move(group.files), {}, {}, std::move(note)};
}

// The dives of a folder: one, unless it holds survey files that do not belong together.
std::vector<DiveInput> DivesIn(const fs::path& folder, bool raw, bool one_dive) {
  DiveInput dive{NameOf(folder), {}, folder};
  try {
    dive.files = IsDive(folder) ? LogsOfDive(folder, raw) : FilesIn(folder);
  } catch (const std::runtime_error& e) {  // of several dives the others are mapped
    dive.problem = e.what();
  }
  if (!IsOfSurveyFiles(dive)) return {dive};
  std::vector<SurveyGroup> groups = GroupSurveyFiles(dive.files, one_dive);
  if (groups.size() == 1) return {dive};
  std::vector<DiveInput> dives;
  for (SurveyGroup& group : groups) {
    const std::string name = dive.name + " " + DayOf(group);
    dives.push_back(DiveOf(std::move(group), name));
  }
  return dives;
}

// The dives of survey files that were named one by one, each with the place of its first file.
void AddLoose(const std::vector<fs::path>& files,
              const std::vector<fs::path>& inputs,
              bool one_dive,
              std::multimap<std::size_t, DiveInput>* dives) {
  for (SurveyGroup& group : GroupSurveyFiles(files, one_dive)) {
    const auto first = std::find(inputs.begin(), inputs.end(), group.files[0]) - inputs.begin();
    const std::string name = DayOf(group);
    dives->emplace(first, DiveOf(std::move(group), name));
  }
}

}  // namespace

std::vector<DiveInput> DivesAmong(const std::vector<fs::path>& inputs, bool raw, bool one_dive) {
  std::multimap<std::size_t, DiveInput> by_place;
  std::vector<fs::path> loose, beside, profiles, empty;
  DiveInput logs{kLogs, {}};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const fs::path& input = inputs[i];
    if (fs::is_directory(input)) {
      for (DiveInput& dive : DivesIn(input, raw, one_dive)) by_place.emplace(i, std::move(dive));
    } else if (IsExternalNavigation(input)) {
      beside.push_back(input);
    } else if (IsProfileFile(input)) {
      profiles.push_back(input);
    } else if (SurveyFiles::IsSurveyFile(input)) {
      loose.push_back(input);
    } else if (IsLog(input)) {
      logs.files.push_back(input);
    } else {
      if (fs::file_size(input) > 0) throw DataError(input.string() + ": " + ForeignText(input));
      empty.push_back(input);
    }
  }
  AddLoose(loose, inputs, one_dive, &by_place);
  if (!logs.files.empty()) {
    const auto first = std::find(inputs.begin(), inputs.end(), logs.files[0]) - inputs.begin();
    by_place.emplace(first, std::move(logs));
  }
  std::vector<DiveInput> dives;
  for (auto& [place, dive] : by_place) dives.push_back(std::move(dive));
  if (dives.empty() && !empty.empty())
    throw DataError(empty[0].string() + ": " + ForeignText(empty[0]));
  NameForeign(empty);
  ExpectOnce(dives, beside);
  AddBeside(beside, &dives);
  if (!profiles.empty()) ExpectSurveyFiles(dives, profiles[0], "a sound speed profile");
  for (DiveInput& dive : dives) dive.profiles = profiles;
  std::set<std::string> names;
  for (DiveInput& dive : dives) {
    const std::string name = dive.name;
    for (int n = 2; !names.insert(dive.name).second; ++n)
      dive.name = name + " (" + std::to_string(n) + ")";
  }
  return dives;
}

}  // namespace seastitch
