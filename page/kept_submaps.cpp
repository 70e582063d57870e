#include "page/kept_submaps.hpp"

#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "common/runtime/files/dive_folder.hpp"
#include "common/storage/submap_file.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// The index that was written last, in map/, map-2/, ... of a dive.
fs::path NewestIndex(const fs::path& dive) {
  fs::path newest;
  fs::file_time_type newest_time;
  std::error_code error;
  for (fs::recursive_directory_iterator it(dive, error), end; !error && it != end;
       it.increment(error)) {
    if (it.depth() > 2) it.disable_recursion_pending();
    if (it->path().filename() != kSubmapIndex) continue;
    const fs::file_time_type time = it->last_write_time(error);
    if (!newest.empty() && time <= newest_time) continue;
    newest = it->path();
    newest_time = time;
  }
  return newest;
}

// A line of the index with the points of its file. Throws where either cannot be read.
Submap SubmapOf(const std::string& line, const fs::path& folder) {
  const nlohmann::json record = nlohmann::json::parse(line);
  Submap submap;
  submap.id = SubmapId{record.at("id").get<std::int32_t>()};
  submap.frame_time = FromUtime(record.at("frame_utime").get<std::int64_t>());
  for (const nlohmann::json& corner : record.at("footprint_m"))
    submap.footprint.emplace_back(corner.at(0).get<double>(), corner.at(1).get<double>());
  const fs::path file = fs::path(record.at("file").get<std::string>()).filename();
  SubmapPcd pcd = ReadSubmapPcd(folder / file);
  submap.T_map_submap = pcd.T_map_submap;
  submap.cloud = std::move(pcd.cloud);
  return submap;
}

}  // namespace

void KeptSubmaps::LookForNewest() {
  if (dives_dir_.empty()) return;
  const auto dive = NewestDive(dives_dir_);
  const fs::path newest = dive ? NewestIndex(*dive) : fs::path();
  if (newest == index_) return;
  index_ = newest;
  read_ = 0;
}

std::optional<Submap> KeptSubmaps::Next() {
  if (index_.empty()) return std::nullopt;
  std::ifstream in(index_);
  in.seekg(static_cast<std::streamoff>(read_));
  for (std::string line; std::getline(in, line);) {
    if (in.eof()) return std::nullopt;  // it is being written
    read_ += line.size() + 1;
    try {
      return SubmapOf(line, index_.parent_path());
    } catch (const std::exception&) {
      ++damaged_;
    }
  }
  return std::nullopt;
}

}  // namespace seastitch
