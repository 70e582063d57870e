#include "products/map/map_extent.hpp"

#include <cstdio>
#include <stdexcept>
#include <string>

#include "products/map/map_points.hpp"

namespace seastitch {
namespace {

double CellCount(const Eigen::AlignedBox2d& box, double cell_m) {
  return (box.sizes().x() / cell_m + 2.0) * (box.sizes().y() / cell_m + 2.0);
}

}  // namespace

Eigen::AlignedBox2d BoxOf(const Survey& survey,
                          const SurveyPoses& poses,
                          const MapProjection& projection) {
  Eigen::AlignedBox2d box;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i)
    box.extend(NorthEastBox(survey.submaps, poses, i, projection));
  return box;
}

Eigen::Vector2d MiddleOf(const Survey& survey) {
  Eigen::AlignedBox2d box;
  for (const SurveySubmap& s : survey.submaps)
    if (HasSoundings(s.trigger)) box.extend(s.T_map_submap.translation().head<2>().eval());
  if (box.isEmpty())
    for (const TrackState& s : survey.track) box.extend(s.p_map.head<2>().eval());
  return box.center();
}

bool IsWild(const Eigen::AlignedBox2d& with_solved, const Eigen::AlignedBox2d& dead_reckoned) {
  constexpr double kGrowth = 3.0, kSlackM = 1000.0;
  return with_solved.diagonal().norm() > kGrowth * dead_reckoned.diagonal().norm() + kSlackM;
}

double ChooseCell(const Survey& survey,
                  const Eigen::AlignedBox2d& box,
                  double cell_m,
                  std::size_t max_cells) {
  const auto most = static_cast<double>(max_cells);
  if (cell_m > 0.0) {
    if (CellCount(box, cell_m) <= most) return cell_m;
    char cells[80];
    std::snprintf(cells,
                  sizeof cells,
                  "cell_m = %g: the map would have %.3g cells",
                  cell_m,
                  CellCount(box, cell_m));
    throw std::runtime_error(std::string(cells) + ", at most " + std::to_string(max_cells) +
                             " are allowed");
  }
  cell_m = DefaultCell(survey.submaps);
  while (CellCount(box, cell_m) > most) cell_m = RoundUpOneTwoFive(1.01 * cell_m);
  return cell_m;
}

}  // namespace seastitch
