#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "common/core/placed_soundings.hpp"

namespace seastitch {

// The soundings of a survey on disk, some 20 bytes each, until the submaps have their final places.
// The file is this log's own and goes with it.
class SoundingLog {
 public:
  // Throws std::runtime_error naming the file that cannot be made.
  explicit SoundingLog(std::filesystem::path file);
  ~SoundingLog();
  SoundingLog(const SoundingLog&) = delete;
  SoundingLog& operator=(const SoundingLog&) = delete;

  // inputs: of each ping, its place in Survey::inputs. Throws std::runtime_error where the disk is
  // full.
  void Add(const SubmapSoundings& submap, const std::vector<std::uint16_t>& inputs);

  // In the order in which they came, one submap in memory at a time. Throws as Add().
  void ForEach(const std::function<void(const SubmapSoundings&,
                                        const std::vector<std::uint16_t>& inputs)>& take);

 private:
  struct Block {
    SubmapId id;
    std::uint64_t pings;
    std::uint64_t soundings;
  };

  std::filesystem::path path_;
  std::fstream file_;
  std::vector<Block> blocks_;
};

}  // namespace seastitch
