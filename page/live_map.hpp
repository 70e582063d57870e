#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/grid.hpp"
#include "common/core/submap.hpp"
#include "viewer/map_data.hpp"

namespace seastitch {

// The map of a dive while it grows, for the viewer: a coarse grid of each submap, placed by dead
// reckoning and by the newest solution. Coordinates are those of the map frame.
//
// Memory is bounded: beyond most_cells the cells of all submaps double in size, and beyond
// kMostTrackPoints every other point of the track is left out.
class LiveMap {
 public:
  static constexpr std::size_t kMostTrackPoints = 20'000;

  // cell_m: of a submap's grid, at first.
  explicit LiveMap(double cell_m = 0.5, std::size_t most_cells = 1'000'000);

  // A submap that was closed. One whose number belongs to another submap begins a new map: true.
  bool Add(const Submap& submap);
  // The newest solution. One of a foreign graph misplaces submaps until the next of their own.
  void Add(const PoseGraph& solution);
  // The vehicle by dead reckoning (NAV): north, east [m].
  void AddTrack(Time time, const Eigen::Vector2d& north_east);

  // Rises with everything that changes the map but the track.
  std::uint64_t version() const { return version_; }
  bool Holds(SubmapId id) const { return pieces_.contains(id); }
  std::size_t submaps() const { return pieces_.size(); }
  std::size_t closures(bool used) const;
  std::size_t cells() const { return cells_; }

  // The map as viewer.js reads it. Absent: there is no submap yet.
  std::optional<std::string> Json() const;

 private:
  // Mean depth of the soundings in a cell of a submap's level frame.
  struct Cell {
    std::int32_t row = 0, col = 0;
    float depth_m = 0.0f;  // below the map's zero
    float weight = 0.0f;
  };
  struct Piece {
    Time frame_time;
    Pose2 dead_reckoned;
    Footprint outline;
    double apart_m = 0.0;  // of its points, in the mean
    std::vector<Cell> cells;
  };
  struct TrackPoint {
    Time time;
    Eigen::Vector2d north_east;
  };
  enum class Poses { kDeadReckoned, kSolved };

  // In the level frame of its submap.
  Eigen::Vector2d Middle(const Cell& cell) const {
    return cell_m_ * Eigen::Vector2d(cell.row + 0.5, cell.col + 0.5);
  }
  void Clear();
  void Coarsen();
  double TypicalSpacing() const;
  Pose2 PoseOf(SubmapId id, const Piece& piece, Poses poses) const;
  std::optional<GridGeometry> Geometry() const;
  std::vector<float> Elevations(const GridGeometry& geometry, Poses poses) const;
  MapLines::Line CorrectedTrack() const;
  MapLines Lines() const;

  const double finest_m_;
  double cell_m_;
  const std::size_t most_cells_;
  std::size_t cells_ = 0;  // of all pieces
  std::map<SubmapId, Piece> pieces_;
  std::optional<PoseGraph> solution_;
  std::map<SubmapId, Pose2> solved_;  // of solution_
  std::vector<TrackPoint> track_;
  std::size_t track_every_ = 1, track_skipped_ = 0;
  std::uint64_t version_ = 0;
};

}  // namespace seastitch
