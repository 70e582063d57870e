#include "tools/install_paths.hpp"

#include <stdexcept>
#include <vector>

namespace seastitch {

namespace fs = std::filesystem;

fs::path BinDir() { return fs::read_symlink("/proc/self/exe").parent_path(); }

fs::path ConfigDir() {
  // Relative to build/bin, to build/PRESET/bin, then to an installed program.
  for (const fs::path& dir :
       {BinDir() / "../../config", BinDir() / "../../../config", fs::path("/etc/seastitch")}) {
    if (fs::exists(dir / "mapper.yaml")) return fs::canonical(dir);
  }
  throw std::runtime_error("no shipped configuration found (mapper.yaml): name one with --config");
}

}  // namespace seastitch
