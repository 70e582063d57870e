#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "common/core/calibration.hpp"
#include "common/core/placed_soundings.hpp"
#include "mapper/calibration/calibration_cells.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Calibration of a dive's sonar by the overlaps of its own submaps: keeps the cells of each submap
// in a temporary file, which is deleted with this object.
class SelfCalibration {
 public:
  // T_vehicle_sonar: place and axes of each head. used: what the soundings are placed with.
  // Throws std::runtime_error naming the file that cannot be made.
  SelfCalibration(std::filesystem::path file,
                  SonarHeads T_vehicle_sonar,
                  const SonarCalibration& used);
  ~SelfCalibration();
  SelfCalibration(const SelfCalibration&) = delete;
  SelfCalibration& operator=(const SelfCalibration&) = delete;

  // Throws std::runtime_error where the disk is full.
  void Add(const SubmapSoundings& submap);
  // By the poses of the survey's solution.
  CalibrationEstimate Estimate(const Survey& survey);

 private:
  struct Block {
    SubmapId id;
    double cell_m;
    std::uint64_t cells;
    std::int64_t at;  // bytes from the start of the file
  };
  CalibrationCells Load(const Block& block);

  const std::filesystem::path path_;
  const SonarHeads T_vehicle_sonar_;
  const SonarCalibration used_;
  std::fstream file_;
  std::vector<Block> blocks_;
};

}  // namespace seastitch
