#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/parameters/parameters.hpp"

namespace seastitch {

// A kind of file in config/, with its table bound to the defaults.
struct ConfigurationFile {
  std::string name;  // of the shipped file
  std::string title;
  std::shared_ptr<void> defaults;
  ParameterTable table;
};
std::vector<ConfigurationFile> ConfigurationFiles();

// The text of docs/configuration.md.
std::string ConfigurationPage();

}  // namespace seastitch
