#pragma once

#include <filesystem>
#include <string>

// Where the tree that the tests were built from lies. The paths are known to paths.cpp alone: as
// literals in every test they would make the compiler's warnings depend on their lengths.
namespace seastitch {

std::filesystem::path SourceDir();
std::filesystem::path BuildDir();

// A shipped configuration, by its name in config/.
std::string ConfigFile(const std::string& name);

// A program of the project.
std::string Program(const std::string& name);

// Golden vectors and real data lie beside the project, not in it: tests that need them skip, and
// say so, where they are absent.
std::filesystem::path Shared(const std::string& name);

}  // namespace seastitch
