#include "tools/install_paths.hpp"

#include <stdexcept>
#include <vector>

namespace seastitch {

namespace fs = std::filesystem;

fs::path BinDir() { return fs::read_symlink("/proc/self/exe").parent_path(); }

fs::path ConfigDir() {
  // build/bin, build/PRESET/bin, then an installed program.
  for (const fs::path& dir :
       {BinDir() / "../../config", BinDir() / "../../../config", fs::path("/etc/seastitch")}) {
    if (fs::exists(dir / "mapper.yaml")) return fs::canonical(dir);
  }
  throw std::runtime_error("no shipped configuration found (mapper.yaml): name one with --config");
}

}  // namespace seastitch
