#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

// The seabed of the simulated survey. Map frame: north, east [m]; depth below the water line, down.
namespace seastitch::bench {

class Terrain {
 public:
  virtual ~Terrain() = default;
  // Depth at a position; nothing if it is unknown.
  virtual std::optional<double> DepthAt(double north_m, double east_m) const = 0;
};

// Self-similar relief: the amplitude falls with wavelength^hurst. Natural seabeds have 0.7 to 1.
struct ReliefParams {
  double rms_m = 0.0;  // 0: none
  double longest_m = 120.0;
  double shortest_m = 1.0;  // waves shorter than the footprint of a beam are not visible
  double hurst = 0.9;
};

// Waves with curved crests of varying height.
struct SandWaveParams {
  double height_m = 0.0;  // trough to crest; 0: none
  double length_m = 12.0;
  double heading_deg = 0.0;  // direction in which the waves follow each other, clockwise from north
};

// A pipe that follows the seabed.
struct PipelineParams {
  double diameter_m = 0.0;  // 0: none
  double north_m = 0.0;     // a point of the pipe
  double east_m = 0.0;
  double heading_deg = 0.0;
};

// A strip across the survey without relief and waves, where no registration is possible.
struct FlatStripParams {
  double from_north_m = 0.0;
  double to_north_m = 0.0;  // not above from_north_m: none
};

struct ProceduralParams {
  double depth_m = 25.0;
  double slope_north = 0.0;  // increase of depth per metre
  double slope_east = 0.0;
  ReliefParams relief;
  SandWaveParams sand_waves;
  PipelineParams pipeline;
  FlatStripParams flat_strip;
};

// Relief of gradient noise (Perlin, SIGGRAPH 2002) on lattices filled by an integer hash: equal on
// every machine, continuous in its second derivative, unbounded.
class ProceduralTerrain : public Terrain {
 public:
  ProceduralTerrain(const ProceduralParams& params, std::uint64_t seed);
  std::optional<double> DepthAt(double north_m, double east_m) const override;

 private:
  struct Octave {
    double cos_per_m;  // rotation and scale
    double sin_per_m;
    double amplitude_m;
    std::uint64_t seed;
  };
  double Relief(double north_m, double east_m) const;
  double SandWave(double north_m, double east_m) const;
  double PipeHeight(double north_m, double east_m) const;
  double Roughness(double north_m) const;  // 0 inside the flat strip, 1 outside

  ProceduralParams params_;
  std::vector<Octave> octaves_;
  Eigen::Vector2d wave_direction_;
  Eigen::Vector2d pipe_direction_;
  std::uint64_t wave_seed_;
};

// Sum of two terrains' depths.
class SumTerrain : public Terrain {
 public:
  SumTerrain(std::unique_ptr<Terrain> a, std::unique_ptr<Terrain> b)
      : a_(std::move(a)), b_(std::move(b)) {}
  std::optional<double> DepthAt(double north_m, double east_m) const override {
    const auto a = a_->DepthAt(north_m, east_m);
    if (!a) return std::nullopt;
    const auto b = b_->DepthAt(north_m, east_m);
    if (!b) return std::nullopt;
    return *a + *b;
  }

 private:
  std::unique_ptr<Terrain> a_;
  std::unique_ptr<Terrain> b_;
};

// A box of the map.
struct MapBox {
  Eigen::Vector2d min{0.0, 0.0};  // north, east
  Eigen::Vector2d max{0.0, 0.0};
};

// Depths on a regular grid, rows to the north, columns to the east, NaN if unknown. Interpolated
// with a continuous first derivative (Catmull-Rom).
class GridTerrain : public Terrain {
 public:
  struct Cells {
    int rows = 0;
    int cols = 0;
    double cell_north_m = 1.0;
    double cell_east_m = 1.0;
    std::vector<float> depth_m;  // row after row, from the south
  };
  // Fills holes within fill_m of known cells; others remain unknown. Places the box where it covers
  // most known cells; of several such places, nearest to the grid's centre.
  GridTerrain(Cells cells, double fill_m, const MapBox& box);

  std::optional<double> DepthAt(double north_m, double east_m) const override;
  // Map position of the grid's south-west corner.
  const Eigen::Vector2d& corner() const { return corner_; }

 private:
  std::size_t Index(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cells_.cols) +
           static_cast<std::size_t>(col);
  }
  void Fill(double fill_m);
  void Place(const MapBox& box);

  Cells cells_;
  std::vector<std::uint8_t> known_;
  Eigen::Vector2d corner_{0.0, 0.0};
};

}  // namespace seastitch::bench
