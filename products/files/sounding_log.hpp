#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "common/core/placed_soundings.hpp"

namespace seastitch {

// Temporary file of the soundings of a survey, some 20 bytes each, until the submaps have their
// final poses. Deleted with this object.
class SoundingLog {
 public:
  // Throws std::runtime_error naming the file that cannot be made.
  explicit SoundingLog(std::filesystem::path file);
  ~SoundingLog();
  SoundingLog(const SoundingLog&) = delete;
  SoundingLog& operator=(const SoundingLog&) = delete;

  // inputs: index of each ping's file in Survey::inputs. Throws std::runtime_error where the disk
  // is full.
  void Add(const SubmapSoundings& submap, const std::vector<std::uint16_t>& inputs);

  // Calls take for every submap in the order of Add(), one in memory at a time. Throws as Add().
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
