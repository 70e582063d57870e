#include "products/files/submap_files.hpp"

#include <charconv>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <system_error>

#include "common/storage/submap_file.hpp"
#include "products/map/map_points.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// submap_ID.pcd
bool IsSubmapFile(std::string_view name) {
  constexpr std::string_view kHead = "submap_";
  constexpr std::string_view kTail = ".pcd";
  if (!name.starts_with(kHead) || !name.ends_with(kTail)) return false;
  const char* const end = name.data() + name.size() - kTail.size();
  std::int32_t id = 0;
  const auto [rest, error] = std::from_chars(name.data() + kHead.size(), end, id);
  return error == std::errc() && rest == end;
}

}  // namespace

void RewriteSubmaps(const Survey& survey, const SurveyPoses& poses, const fs::path& dir) {
  std::set<std::string> ours;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    const SurveySubmap& s = survey.submaps[i];
    if (s.points == 0) continue;
    const std::string name = "submap_" + std::to_string(s.id.value) + ".pcd";
    ours.insert(name);
    WriteSubmapPcd(dir / name, LoadCloud(s, poses.ShearOf(i)), SubmapPose(s, poses.T_map_level[i]));
  }
  // Submaps of an earlier, longer run in the same folder would be read as part of this one.
  for (const fs::directory_entry& entry : fs::directory_iterator(dir)) {
    const std::string name = entry.path().filename().string();
    if (IsSubmapFile(name) && !ours.contains(name)) fs::remove(entry.path());
  }
}

}  // namespace seastitch
