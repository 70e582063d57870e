#include "survey/plan/profiles_beside.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "codecs/profile_text.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "survey/errors.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kWithinS = 24.0 * 3600.0;
// The mapper keeps so many.
constexpr std::size_t kMostProfiles = 64;

ProfileText Read(const fs::path& file) {
  const std::optional<std::string> text = ReadWholeFile(file);
  return text ? ParseProfileText(*text) : ProfileText{{}, "cannot be read"};
}

// The profile files beside those of the survey, by name, each once.
std::vector<fs::path> FilesBeside(const ProfileChoice& choice, const SurveyPlan& plan) {
  std::set<fs::path> folders;
  for (const PlannedFile& file : plan.files) folders.insert(fs::absolute(file.path).parent_path());
  std::map<fs::path, fs::path> files;  // by their real path
  for (const fs::path& file : choice.named) files.emplace(fs::weakly_canonical(file), file);
  for (const fs::path& folder : folders) {
    std::error_code unreadable;  // a file can be read in a folder that cannot be listed
    for (const auto& entry : fs::directory_iterator(folder, unreadable))
      if (entry.is_regular_file() && IsProfileFile(entry.path()))
        files.emplace(fs::weakly_canonical(entry.path()), entry.path());
  }
  std::vector<fs::path> sorted;
  for (const auto& [real, file] : files) sorted.push_back(file);
  return sorted;
}

// Seconds to the nearest begin of a survey file.
double ApartS(Time time, const SurveyPlan& plan) {
  double nearest_s = std::numeric_limits<double>::infinity();
  for (const PlannedFile& file : plan.files)
    if (file.begin) nearest_s = std::min(nearest_s, std::abs(ToSeconds(time - *file.begin)));
  return nearest_s;
}

Time BeginOf(const SurveyPlan& plan) {
  std::optional<Time> begin;
  for (const PlannedFile& file : plan.files)
    if (file.begin && (!begin || *file.begin < *begin)) begin = file.begin;
  return begin.value_or(Time());
}

std::string CastsText(std::size_t casts) {
  return casts == 1 ? "1 cast" : std::to_string(casts) + " casts";
}

std::string NamesOf(const std::vector<fs::path>& files) {
  return files[0].filename().string() + (files.size() > 1 ? " and others beside it" : "");
}

void Warn(const fs::path& file, const std::string& why, SurveyPlan* plan) {
  plan->warnings.push_back({WarningCode::kProfileNotUsed, file.filename().string() + ": " + why});
}

// Soundings that are placed already need no profile.
void UseNone(const ProfileChoice& choice, SurveyPlan* plan) {
  constexpr char kWhy[] = "not used: the files have soundings that are placed already";
  if (!choice.only.empty()) return Warn(choice.only, kWhy, plan);
  for (const fs::path& file : choice.named) Warn(file, kWhy, plan);
}

void UseOnly(const fs::path& file, SurveyPlan* plan) {
  ProfileText read = Read(file);
  if (read.casts.empty()) throw DataError(file.string() + ": " + read.problem);
  if (!read.problem.empty()) Warn(file, read.problem, plan);
  for (ProfileCast& cast : read.casts) {
    if (!cast.time) cast.profile.time = BeginOf(*plan);
    plan->profiles.push_back(std::move(cast.profile));
  }
  plan->own_profiles_unused = true;
  plan->profile_text = "sound speed profile: " + file.filename().string() + ", " +
                       CastsText(plan->profiles.size()) + ", in place of any other\n";
}

}  // namespace

bool IsProfileFile(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension == ".asvp" || extension == ".svp";
}

void ChooseProfiles(const ProfileChoice& choice, bool has_own, SurveyPlan* plan) {
  if (!plan->raw_pings) return UseNone(choice, plan);
  if (!choice.only.empty()) return UseOnly(choice.only, plan);
  const std::vector<fs::path> files = FilesBeside(choice, *plan);
  if (files.empty()) return;
  if (has_own) {
    plan->profile_text =
        "sound speed profiles: those of the survey files; not used: " + NamesOf(files) + "\n";
    return;
  }
  std::vector<std::pair<double, SoundVelocityProfile>> casts;  // with seconds to the survey
  std::string names;
  for (const fs::path& file : files) {
    ProfileText read = Read(file);
    if (!read.problem.empty()) Warn(file, read.problem, plan);
    const std::size_t before = casts.size();
    for (ProfileCast& cast : read.casts) {
      if (!cast.time) cast.profile.time = BeginOf(*plan);
      const double apart_s = cast.time ? ApartS(*cast.time, *plan) : 0.0;
      if (apart_s <= kWithinS) casts.emplace_back(apart_s, std::move(cast.profile));
    }
    if (casts.size() > before)
      names += (names.empty() ? "" : ", ") + file.filename().string();
    else if (!read.casts.empty())
      Warn(file, "no cast within 24 h of a survey file; --profile uses it all the same", plan);
  }
  if (casts.empty()) return;
  std::stable_sort(
      casts.begin(), casts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  casts.resize(std::min(casts.size(), kMostProfiles));
  for (auto& [apart_s, profile] : casts) plan->profiles.push_back(std::move(profile));
  plan->profile_text = "sound speed profiles: " + CastsText(casts.size()) + " of " + names +
                       ", for each ping the nearest in time\n";
}

}  // namespace seastitch
