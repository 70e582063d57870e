#include "survey/session/self_calibration.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>

#include "mapper/calibration/calibration_solver.hpp"
#include "mapper/calibration/overlap_rows.hpp"

namespace seastitch {
namespace {

static_assert(std::is_trivially_copyable_v<CalibrationCell>);

// Rectangle of the cells' places in the map.
struct Extent {
  Eigen::AlignedBox2d box;
  bool Meets(const Extent& other) const { return box.intersects(other.box); }
};

Extent ExtentOf(const CalibrationCells& cells, const Pose2& T_map_level) {
  Extent extent;
  for (const CalibrationCell& cell : cells.cells)
    extent.box.extend(T_map_level * Eigen::Vector2d(cell.mean_m[0], cell.mean_m[1]));
  return extent;
}

}  // namespace

SelfCalibration::SelfCalibration(std::filesystem::path file,
                                 SonarHeads T_vehicle_sonar,
                                 const SonarCalibration& used)
    : path_(std::move(file)),
      T_vehicle_sonar_(std::move(T_vehicle_sonar)),
      used_(used),
      file_(path_, std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary) {
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

SelfCalibration::~SelfCalibration() {
  file_.close();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

void SelfCalibration::Add(const SubmapSoundings& submap) {
  const CalibrationCells cells = CellsOf(submap, T_vehicle_sonar_);
  if (cells.cells.empty()) return;
  blocks_.push_back(
      {submap.id, cells.cell_m, cells.cells.size(), static_cast<std::int64_t>(file_.tellp())});
  file_.write(reinterpret_cast<const char*>(cells.cells.data()),
              static_cast<std::streamsize>(cells.cells.size() * sizeof(CalibrationCell)));
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written: disk full?");
}

CalibrationCells SelfCalibration::Load(const Block& block) {
  CalibrationCells cells{block.cell_m, std::vector<CalibrationCell>(block.cells)};
  file_.seekg(block.at);
  file_.read(reinterpret_cast<char*>(cells.cells.data()),
             static_cast<std::streamsize>(block.cells * sizeof(CalibrationCell)));
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be read back");
  return cells;
}

CalibrationEstimate SelfCalibration::Estimate(const Survey& survey) {
  const SurveyPoses poses = SolvedPoses(survey);
  std::vector<Block> blocks;
  std::vector<Time> times;
  std::vector<CellsPlace> places;
  std::vector<Extent> extents;
  SoundingNoise noise;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    const SurveySubmap& submap = survey.submaps[i];
    const auto block = std::find_if(
        blocks_.begin(), blocks_.end(), [&](const Block& b) { return b.id == submap.id; });
    if (block == blocks_.end()) continue;
    const CalibrationCells cells = Load(*block);
    noise.Add(cells);
    blocks.push_back(*block);
    times.push_back(submap.frame_time);
    places.push_back(
        {poses.T_map_level[i], submap.T_map_submap.translation().z(), poses.ShearOf(i)});
    extents.push_back(ExtentOf(cells, poses.T_map_level[i]));
  }
  noise.Finish();
  CalibrationEstimate estimate =
      EstimateCalibration(times, [&](const std::function<void(const OverlapOfPair&)>& take) {
        for (std::size_t source = 1; source < blocks.size(); ++source) {
          const CalibrationCells of_source = Load(blocks[source]);
          for (std::size_t target = 0; target < source; ++target) {
            if (!extents[target].Meets(extents[source])) continue;
            OverlapOfPair pair{target, source, {}};
            pair.rows =
                RowsOf(Load(blocks[target]), places[target], of_source, places[source], noise);
            if (!pair.rows.empty()) take(pair);
          }
        }
      });
  estimate.used = used_;
  return estimate;
}

}  // namespace seastitch
