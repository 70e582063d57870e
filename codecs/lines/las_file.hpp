#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "codecs/lines/line_points.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// What the head of a LAS file states (ASPRS LAS 1.0 to 1.4).
struct LasHead {
  bool compressed = false;     // LAZ
  std::uint8_t format = 0;     // of the points, 0 to 10
  bool adjusted_time = false;  // times are GPS seconds since 1980 less 1e9; else of the GPS week
  std::size_t head_bytes = 0;  // all bytes before the first point
  std::size_t point_bytes = 0;
  std::uint64_t points = 0;  // 0: not stated
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  // Coordinate reference system: WKT, or "EPSG:" and a number from GeoTIFF keys. Empty: not stated.
  std::string crs;
  std::optional<double> z_unit_m;  // from GeoTIFF keys

  bool has_time() const;
};

// Length of all that precedes the points, from the first 100 bytes. Nothing: no LAS file.
std::optional<std::size_t> LasHeadBytes(Bytes bytes);
// The head from at least those bytes. Nothing: it contradicts itself.
std::optional<LasHead> ReadLasHead(Bytes bytes);

// Reader of a LAS file. Points that are withheld or noise (classes 7 and 18) are left out. The line
// of a point is its point source ID; a time of 0 is none. Seconds of the GPS week are within half a
// week of the first point's. Also counts las_points_withheld and las_points_noise. missing() counts
// points.
class LasFileReader : public SurveyReader {
 public:
  explicit LasFileReader(std::unique_ptr<LinePoints> points) : points_(std::move(points)) {}

  Counters counters() const override;

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;
  void End(std::vector<SurveyRecord>* out) override;

 private:
  bool IsInPoints() const { return head_ && (head_->points == 0 || read_ < head_->points); }
  void ReadPoint(Bytes record, std::vector<SurveyRecord>* out);

  std::unique_ptr<LinePoints> points_;
  bool at_start_ = true;
  std::optional<LasHead> head_;
  std::uint64_t read_ = 0;         // points
  std::optional<double> first_s_;  // time of the first point that has one
};

}  // namespace seastitch
