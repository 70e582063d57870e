#pragma once

#include <filesystem>

namespace seastitch {

// Mappers that were to go on in a map and ended soon after. As far as anybody can tell, what ends
// them is in the map, and starting again does not make it go away: after kMost of them in a row
// another map is to be begun. Counted in MAP/starts; a disk that refuses it counts none.
class MapStarts {
 public:
  static constexpr int kMost = 3;
  static constexpr double kSoonS = 10.0;

  // Of a map that has a journal.
  explicit MapStarts(std::filesystem::path map);

  // In a row, before this one.
  int ended_soon() const { return ended_soon_; }
  // This mapper is about to read the map; it counts until it has survived.
  void Begin();
  // Every second, by a monotonic clock. has_gone_on: with the first samples of navigation's input.
  // Waiting for these for kSoonS counts as survival too: then it was read without harm.
  void Tick(bool has_gone_on, double now_s);
  // It ends in order, say.
  void Survive();

 private:
  void Write(int starts) const;

  const std::filesystem::path file_;
  int ended_soon_ = 0;
  bool counts_ = false;
  bool has_gone_on_ = false;
  double since_s_ = -1.0;  // of the last change of it; below 0: not yet
};

}  // namespace seastitch
