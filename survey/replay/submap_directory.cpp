#include "survey/replay/submap_directory.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/core/pose.hpp"
#include "common/storage/submap_file.hpp"
#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/level_cloud.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::optional<int> FirstNumber(const std::string& name) {
  const std::size_t begin = name.find_first_of("0123456789");
  if (begin == std::string::npos) return std::nullopt;
  int number = 0;
  const auto result = std::from_chars(name.data() + begin, name.data() + name.size(), number);
  if (result.ec != std::errc{}) return std::nullopt;
  return number;
}

bool IsSubmap(const fs::path& path) {
  return path.extension() == ".pcd" || path.extension() == ".pdc";
}

std::map<int, fs::path> FilesById(const fs::path& dir) {
  std::map<int, fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(dir)) {
    const fs::path& path = entry.path();
    if (!IsSubmap(path)) continue;
    const std::optional<int> id = FirstNumber(path.filename().string());
    if (!id) throw std::runtime_error(path.string() + ": no submap number in the file's name");
    if (const auto [other, is_new] = files.emplace(*id, path); !is_new) {
      throw std::runtime_error(path.string() + ": submap " + std::to_string(*id) + " is also in " +
                               other->second.filename().string());
    }
  }
  return files;
}

// Sum of the points' heights relative to their frame, in level axes.
double HeightSum(const Submap& submap) {
  const Eigen::RowVector3d z_level = LevelFromBody(submap.T_map_submap).row(2);
  double sum = 0.0;
  for (const Eigen::Vector3f& p : submap.cloud.points) sum += z_level.dot(p.cast<double>());
  return sum;
}

Submap ReadSubmap(int id, const fs::path& path) {
  SubmapPcd file = ReadSubmapPcd(path);
  if (file.cloud.empty()) throw std::runtime_error(path.string() + ": no finite points");
  Submap submap;
  submap.id = SubmapId{id};
  submap.start = submap.end = submap.frame_time = FromUtime(0) + std::chrono::seconds(id);
  submap.T_map_submap = file.T_map_submap;
  submap.trigger = SubmapTrigger::kImported;
  submap.cloud = std::move(file.cloud);
  for (const float n : submap.cloud.soundings) {
    submap.soundings_used += static_cast<std::uint64_t>(n);
  }
  submap.soundings_read = submap.soundings_used;
  submap.footprint = FootprintOf(LevelCloud(submap.cloud, LevelFromBody(submap.T_map_submap)));
  return submap;
}

}  // namespace

bool HoldsSubmaps(const fs::path& dir) {
  const fs::directory_iterator files(dir);
  return std::any_of(begin(files), end(files), [](const auto& f) { return IsSubmap(f.path()); });
}

SubmapDirectory ReadSubmapDirectory(const fs::path& dir, const ImportedDrift& drift) {
  const std::map<int, fs::path> files = FilesById(dir);
  if (files.empty()) {
    throw std::runtime_error(dir.string() + ": no submaps (files .pcd or .pdc) in this directory");
  }
  const double var_xy = drift.sigma_xy_m * drift.sigma_xy_m;
  const double var_yaw = Deg2Rad(drift.sigma_yaw_deg) * Deg2Rad(drift.sigma_yaw_deg);

  SubmapDirectory directory;
  double height_sum = 0.0;
  for (const auto& [id, path] : files) {
    Submap submap = ReadSubmap(id, path);
    height_sum += HeightSum(submap);
    if (!directory.submaps.empty()) {
      submap.covariance_from_previous =
          Eigen::Matrix3d(Eigen::Vector3d(var_xy, var_xy, var_yaw).asDiagonal());
    }
    directory.submaps.push_back(std::move(submap));
  }
  directory.z_up = height_sum < 0.0;
  return directory;
}

}  // namespace seastitch
