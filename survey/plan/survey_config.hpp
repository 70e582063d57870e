#pragma once

#include <filesystem>

#include "mapper/mapper_config.hpp"
#include "survey/plan/survey_files.hpp"

namespace seastitch {

// Sets the navigation and the installation that the files give, and the lengths that their depth of
// water asks for. given_vehicle: the vehicle of `config` is the user's; its mounting is kept for
// raw pings of files without installation parameters.
void UseSurvey(const SurveyPlan& plan, bool given_vehicle, MapperConfig* config);

// The configuration beside an imported log.
struct SurveyConfigFiles {
  std::filesystem::path vehicle;  // LOG.vehicle.yaml
  std::filesystem::path mapper;   // LOG.mapper.yaml
};
SurveyConfigFiles SurveyConfigFilesFor(const std::filesystem::path& log);

}  // namespace seastitch
