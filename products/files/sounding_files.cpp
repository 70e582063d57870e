#include "products/files/sounding_files.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/core/bytes.hpp"
#include "common/geo/map_frame.hpp"
#include "products/files/navigation_files.hpp"
#include "products/track/survey_lines.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct Row {
  Eigen::Vector3d p_ned;
  SubmapSoundings::Ping ping;
  std::uint16_t beam;
  std::uint16_t file;
  std::uint16_t line;
  bool used;
};

class SoundingWriter {
 public:
  virtual ~SoundingWriter() = default;
  virtual void Add(const Row& row) = 0;
  virtual void Finish() = 0;
};

// ASPRS LAS specification 1.4, revision 15.
class LasWriter : public SoundingWriter {
 public:
  LasWriter(const std::optional<Datum>& datum, Time day, std::ofstream* out)
      : wkt_(datum ? ProjectionWkt(*datum) : ""), day_(day), out_(out) {
    WriteHead();
  }

  void Add(const Row& row) override {
    const Eigen::Vector3d p(row.p_ned.y(), row.p_ned.x(), -row.p_ned.z());
    box_.extend(p);
    ByteWriter point;
    for (const double coordinate : p)
      point.Le(static_cast<std::int32_t>(std::lround(coordinate / kScale)));
    point.Le(std::uint16_t{0});    // intensity
    point.Le(std::uint8_t{0x11});  // return 1 of 1
    const int withheld = row.used ? 0 : 1 << 2;
    point.Le(static_cast<std::uint8_t>(withheld | (row.ping.head & 3) << 4));
    point.Le(static_cast<std::uint8_t>(row.used ? kBathymetricPoint : kNoise));
    point.Le(std::uint8_t{0});  // user data
    point.Le(std::int16_t{0});  // scan angle
    point.Le(row.line);
    point.Le(GpsSeconds(row.ping.time) - 1e9);
    point.Le(row.ping.number);
    point.Le(row.beam);
    point.Le(row.file);
    Write(point);
    ++count_;
  }

  void Finish() override {
    out_->seekp(0);
    WriteHead();
  }

 private:
  static constexpr double kScale = 0.001;
  static constexpr int kNoise = 7;
  static constexpr int kBathymetricPoint = 40;
  static constexpr std::uint16_t kHeaderBytes = 375;
  static constexpr std::uint16_t kPointBytes = 30 + 8;
  struct Extra {
    const char* name;
    std::uint8_t type;
  };
  static constexpr std::array<Extra, 3> kExtra{{{"ping", 5}, {"beam", 3}, {"file", 3}}};

  void Write(const ByteWriter& bytes) {
    out_->write(reinterpret_cast<const char*>(bytes.bytes().data()),
                static_cast<std::streamsize>(bytes.size()));
  }

  static void Text(const std::string& text, std::size_t size, ByteWriter* out) {
    const std::size_t n = std::min(text.size(), size);
    out->Append(AsBytes({text.data(), n}));
    out->Zeros(size - n);
  }

  static void RecordHead(const char* user, std::uint16_t id, std::size_t size, ByteWriter* out) {
    out->Le(std::uint16_t{0});
    Text(user, 16, out);
    out->Le(id);
    out->Le(static_cast<std::uint16_t>(size));
    out->Zeros(32);
  }

  ByteWriter Records() const {
    ByteWriter out;
    if (!wkt_.empty()) {
      RecordHead("LASF_Projection", 2112, wkt_.size() + 1, &out);
      Text(wkt_, wkt_.size() + 1, &out);
    }
    RecordHead("LASF_Spec", 4, 192 * kExtra.size(), &out);
    for (const Extra& extra : kExtra) {
      out.Zeros(2);
      out.Le(extra.type);
      out.Zeros(1);
      Text(extra.name, 32, &out);
      out.Zeros(4 + 5 * 24 + 32);
    }
    return out;
  }

  // Counts and extents are right when it is written again at the end.
  void WriteHead() {
    using namespace std::chrono;
    const ByteWriter records = Records();
    const auto days_since = floor<days>(day_.time_since_epoch());
    const year_month_day date{sys_days(days_since)};
    const auto of_year = sys_days(days_since) - sys_days(date.year() / 1 / 1);
    ByteWriter h;
    Text("LASF", 4, &h);
    h.Le(std::uint16_t{0});
    h.Le(std::uint16_t{1 | 16});  // adjusted GPS time, projection as text
    h.Zeros(16);
    h.Le(std::uint8_t{1});
    h.Le(std::uint8_t{4});
    Text("MERGE", 32, &h);
    Text("Seastitch", 32, &h);
    h.Le(static_cast<std::uint16_t>(of_year.count() + 1));
    h.Le(static_cast<std::uint16_t>(static_cast<int>(date.year())));
    h.Le(kHeaderBytes);
    h.Le(static_cast<std::uint32_t>(kHeaderBytes + records.size()));
    h.Le(std::uint32_t{wkt_.empty() ? 1u : 2u});
    h.Le(std::uint8_t{6});
    h.Le(kPointBytes);
    h.Zeros(4 + 5 * 4);  // counts of before 1.4
    for (int axis = 0; axis < 3; ++axis) h.Le(kScale);
    for (int axis = 0; axis < 3; ++axis) h.Le(0.0);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      h.Le(count_ == 0 ? 0.0 : box_.max()(axis));
      h.Le(count_ == 0 ? 0.0 : box_.min()(axis));
    }
    h.Zeros(8 + 8 + 4);
    h.Le(count_);
    h.Le(count_);
    h.Zeros(14 * 8);
    h.Append(records.bytes());
    Write(h);
  }

  const std::string wkt_;
  const Time day_;
  std::ofstream* const out_;
  std::uint64_t count_ = 0;
  Eigen::AlignedBox3d box_;
};

class XyzWriter : public SoundingWriter {
 public:
  XyzWriter(const std::optional<Datum>& datum, std::ofstream* out) : out_(out) {
    if (datum) map_.emplace(*datum);
    *out_ << (datum ? "# longitude latitude" : "# east_m north_m")
          << " depth_m time file line ping head beam used\n";
  }

  void Add(const Row& row) override {
    char place[80];
    if (map_) {
      const Datum point = map_->PointAt(row.p_ned.head<2>(), row.p_ned.z());
      std::snprintf(place,
                    sizeof place,
                    "%.9f %.9f %.3f",
                    point.longitude_deg,
                    point.latitude_deg,
                    row.p_ned.z());
    } else {
      std::snprintf(
          place, sizeof place, "%.3f %.3f %.3f", row.p_ned.y(), row.p_ned.x(), row.p_ned.z());
    }
    if (row.ping.time != time_ || text_.empty()) {
      time_ = row.ping.time;
      text_ = IsoTime(time_);
    }
    *out_ << place << ' ' << text_ << ' ' << row.file << ' ' << row.line << ' ' << row.ping.number
          << ' ' << int{row.ping.head} << ' ' << row.beam << ' ' << (row.used ? "1\n" : "0\n");
  }

  void Finish() override {}

 private:
  std::ofstream* const out_;
  std::optional<MapFrame> map_;
  Time time_;
  std::string text_;  // time_
};

// From the level frame of a submap to north, east, depth.
class Placer {
 public:
  Placer(const Survey& survey, const SurveyPoses& poses, MapAxes axes)
      : survey_(survey), poses_(poses), axes_(axes) {
    for (std::size_t i = 0; i < survey.submaps.size(); ++i) place_of_[survey.submaps[i].id] = i;
    const std::vector<SurveyLine> lines = LinesOf(survey);
    line_of_.resize(survey.submaps.size());
    for (std::size_t n = 0; n < lines.size(); ++n)
      for (std::size_t i = lines[n].first; i <= lines[n].last; ++i)
        line_of_[i] = static_cast<std::uint16_t>(n + 1);
  }

  // False: the survey does not have it.
  bool Take(SubmapId id) {
    const auto found = place_of_.find(id);
    if (found == place_of_.end()) return false;
    i_ = found->second;
    T_map_submap_ = SubmapPose(survey_.submaps[i_], poses_.T_map_level[i_]);
    mounting_ = poses_.MountingOf(i_);
    R_level_submap_ = LevelFromBody(survey_.submaps[i_].T_map_submap);
    return true;
  }
  Eigen::Vector3d operator()(const Eigen::Vector3f& p_submap_m) const {
    Eigen::Vector3d p_level = R_level_submap_ * p_submap_m.cast<double>();
    p_level.head<2>() += Shear(p_level.head<2>(), mounting_);
    return ToNorthEastDown(T_map_submap_ * (R_level_submap_.transpose() * p_level), axes_);
  }
  std::uint16_t line() const { return line_of_[i_]; }

 private:
  const Survey& survey_;
  const SurveyPoses& poses_;
  const MapAxes axes_;
  std::map<SubmapId, std::size_t> place_of_;
  std::vector<std::uint16_t> line_of_;
  std::size_t i_ = 0;
  MountingErrors mounting_;
  Eigen::Isometry3d T_map_submap_ = Eigen::Isometry3d::Identity();
  Eigen::Matrix3d R_level_submap_ = Eigen::Matrix3d::Identity();
};

}  // namespace

std::uint64_t WriteSoundings(const Survey& survey,
                             const SurveyPoses& poses,
                             MapAxes axes,
                             const std::optional<Datum>& datum,
                             SoundingFormat format,
                             SoundingLog* log,
                             const fs::path& path) {
  const fs::path partial = path.string() + ".partial";
  std::ofstream out(partial, std::ios::binary | std::ios::trunc);
  std::unique_ptr<SoundingWriter> writer;
  if (format == SoundingFormat::kLas)
    writer = std::make_unique<LasWriter>(datum, survey.submaps.back().end, &out);
  else
    writer = std::make_unique<XyzWriter>(datum, &out);
  Placer place(survey, poses, axes);
  std::uint64_t count = 0;
  log->ForEach([&](const SubmapSoundings& submap, const std::vector<std::uint16_t>& inputs) {
    if (!place.Take(submap.id)) return;
    for (const SubmapSoundings::Sounding& s : submap.soundings)
      writer->Add({place(s.p_submap_m),
                   submap.pings[s.ping],
                   s.beam,
                   static_cast<std::uint16_t>(inputs[s.ping] + 1),
                   place.line(),
                   s.used});
    count += submap.soundings.size();
  });
  writer->Finish();
  out.close();
  std::error_code error;
  if (out) fs::rename(partial, path, error);
  if (out && !error) return count;
  fs::remove(partial, error);
  throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace seastitch
