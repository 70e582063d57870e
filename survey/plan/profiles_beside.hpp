#pragma once

#include <filesystem>

#include "survey/plan/survey_plan.hpp"

// Sound speed profiles in files of their own: beside the survey files, or as the user names one.
namespace seastitch {

// By its name: .asvp or .svp.
bool IsProfileFile(const std::filesystem::path& path);

// Chooses the profiles of a survey with raw pings and says so in the plan: those of ProfileChoice
// ::only; else those that the survey files hold (has_own); else the casts of the profile files in
// the folders of the survey files that lie within 24 h of one of the files. A survey without raw
// pings uses none: a warning for each that the user named. Throws DataError "FILE: reason" where
// `only` cannot be read.
void ChooseProfiles(const ProfileChoice& choice, bool has_own, SurveyPlan* plan);

}  // namespace seastitch
