#include "tests/support/paths.hpp"

namespace seastitch {

std::filesystem::path SourceDir() { return SEASTITCH_SOURCE_DIR; }

std::filesystem::path BuildDir() { return SEASTITCH_BUILD_DIR; }

std::string ConfigFile(const std::string& name) { return SourceDir() / "config" / name; }

std::string Program(const std::string& name) { return BuildDir() / "bin" / name; }

std::filesystem::path Shared(const std::string& name) { return SourceDir() / "../shared" / name; }

}  // namespace seastitch
