#pragma once

#include <filesystem>

namespace seastitch {

// Counts consecutive mappers that ended soon after they continued a map. Probably the map's content
// ends them, and another start would end in the same way: after kMost of them, another map is to be
// begun. The count is in MAP/starts; if the disk cannot be written, nothing is counted.
class MapStarts {
 public:
  static constexpr int kMost = 3;
  static constexpr double kSoonS = 10.0;

  // map: folder of a map that has a journal.
  explicit MapStarts(std::filesystem::path map);

  // Number of them in a row, before this mapper.
  int ended_soon() const { return ended_soon_; }
  // Call it before the map is read. The mapper counts until Survive().
  void Begin();
  // Call it every second. now_s: monotonic clock. has_gone_on: the first samples of navigation's
  // input have come. Waiting for them for kSoonS also counts as survival: the map was read without
  // harm.
  void Tick(bool has_gone_on, double now_s);
  // Call it when the mapper ends regularly.
  void Survive();

 private:
  void Write(int starts) const;

  const std::filesystem::path file_;
  int ended_soon_ = 0;
  bool counts_ = false;
  bool has_gone_on_ = false;
  double since_s_ = -1.0;  // time of the last change of has_gone_on_; below 0: none yet
};

}  // namespace seastitch
