#include "survey/line/line_plan.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "codecs/calendar.hpp"
#include "codecs/lines/las_file.hpp"
#include "codecs/lines/xyz_file.hpp"
#include "common/core/median.hpp"
#include "products/files/navigation_files.hpp"
#include "survey/errors.hpp"
#include "survey/line/text_columns.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kAdjusted_s = 1e9;  // adjusted standard GPS time is less by this
constexpr char kWgs84[] = "+proj=longlat +datum=WGS84 +no_defs";

// Points that follow each other in the file: the first of them, and their mean.
struct Block {
  LinePoint first;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::int64_t points = 0;

  Eigen::Vector3d Mean() const { return sum / static_cast<double>(points); }
  void Add(const Block& other) {
    if (points == 0) first = other.first;
    sum += other.sum;
    points += other.points;
  }
};

// At most kMost blocks of equal numbers of points: those of several pings lie about the track.
class Blocks {
 public:
  void Add(const Block& point) {
    if (blocks_.empty() || blocks_.back().points >= size_) blocks_.emplace_back();
    blocks_.back().Add(point);
    if (blocks_.size() < kMost || blocks_.back().points < size_) return;
    for (std::size_t i = 0; i < kMost / 2; ++i) {
      Block both = blocks_[2 * i];
      both.Add(blocks_[2 * i + 1]);
      blocks_[i] = both;
    }
    blocks_.resize(kMost / 2);
    size_ *= 2;
  }
  const std::vector<Block>& all() const { return blocks_; }

 private:
  static constexpr std::size_t kMost = 64;
  std::vector<Block> blocks_;
  std::int64_t size_ = 1;
};

// What all points of a file have in common.
class Summary : public LinePoints {
 public:
  struct Figures {
    std::int64_t points = 0;
    std::int64_t with_time = 0;
    double first_s = std::numeric_limits<double>::max();
    double last_s = std::numeric_limits<double>::lowest();
    Eigen::AlignedBox3d box;
    std::map<std::uint16_t, Blocks> lines;
  };

  explicit Summary(Figures* figures) : figures_(figures) {}
  void Add(const LinePoint& point, std::vector<SurveyRecord>*) override {
    constexpr std::size_t kMostLines = 4096;
    Figures& f = *figures_;
    ++f.points;
    f.box.extend(point.p);
    if (point.time_s) {
      ++f.with_time;
      f.first_s = std::min(f.first_s, *point.time_s);
      f.last_s = std::max(f.last_s, *point.time_s);
    }
    if (f.lines.size() < kMostLines || f.lines.contains(point.line))
      f.lines[point.line].Add({point, point.p, 1});
  }
  void Finish(std::vector<SurveyRecord>*) override {}

 private:
  Figures* figures_;
};

// Points at most max_bytes into the file. losses: what was not read, for people.
Summary::Figures FiguresOf(const fs::path& path, std::uint64_t max_bytes, std::string* losses) {
  Summary::Figures figures;
  const auto reader = LineReader(path, std::make_unique<Summary>(&figures));
  std::ifstream in(path, std::ios::binary);
  std::vector<std::uint8_t> piece(65'536);
  for (std::uint64_t read = 0; read < max_bytes; read += piece.size()) {
    in.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (got == 0) break;
    reader->Add(Bytes(piece.data(), got));
  }
  reader->Finish();
  for (const auto& [name, count] : reader->counters())
    *losses += ", " + name + " " + std::to_string(count);
  if (!reader->problem().empty()) *losses += "; " + reader->problem();
  return figures;
}

bool IsLas(const fs::path& path) {
  std::string begin(4, '\0');
  std::ifstream(path, std::ios::binary).read(begin.data(), 4);
  return begin == "LASF";
}

LasHead HeadOf(const fs::path& path) {
  constexpr std::size_t kMostBytes = 16 * 1024 * 1024;
  std::ifstream in(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(100);
  in.read(reinterpret_cast<char*>(bytes.data()), 100);
  const auto size = LasHeadBytes(bytes);
  bytes.resize(std::min(size.value_or(0), kMostBytes));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto head = in ? ReadLasHead(bytes) : std::nullopt;
  if (!head) throw DataError(path.string() + ": its LAS head is damaged");
  if (head->compressed)
    throw DataError(path.string() +
                    ": compressed (LAZ), which is not read; decompress it: pdal translate " +
                    path.filename().string() + " " + path.stem().string() + ".las (PDAL)");
  return *head;
}

std::string FirstLineOf(const fs::path& path) {
  std::ifstream in(path);
  std::string line;
  while (std::getline(in, line))
    if (line.starts_with(XyzFormat::kExportHeading) || (!line.empty() && line.front() != '#'))
      break;
  return line;
}

FileNotes NotesOf(const fs::path& path) {
  return fs::exists(ColumnsFileOf(path)) ? LoadFileNotes(path) : FileNotes{};
}

XyzFormat FormatOf(const fs::path& path) {
  const FileNotes notes = NotesOf(path);
  const std::string line = FirstLineOf(path);
  if (notes.columns.empty())
    return line.starts_with(XyzFormat::kExportHeading) ? XyzFormat::Export() : XyzFormat::For(line);
  XyzFormat format{notes.delimiter, notes.header_lines, notes.comment, notes.columns};
  if (const std::string problem = format.Validate(); !problem.empty())
    throw DataError(ColumnsFileOf(path).string() + ": columns: " + problem);
  return format;
}

// --- what a file leaves open ---------------------------------------------------------------------

// A file, its points in short, and the track.
class Planner {
 public:
  Planner(const fs::path& path, std::shared_ptr<const LineTrack> track)
      : path_(path), track_(std::move(track)), notes_(NotesOf(path)) {
    if (IsLas(path))
      las_ = HeadOf(path);
    else
      xyz_ = FormatOf(path);
  }

  LinePlan Plan() {
    if (!track_ || track_->empty())
      Fail(
          "no track of the vehicle beside it: give its navigation, too (SBET, .fnv, .na0, or text "
          "with the file that describes its columns)");
    std::string losses;
    figures_ = FiguresOf(path_, std::numeric_limits<std::uint64_t>::max(), &losses);
    if (figures_.points == 0) Fail("no sounding in it that can be used" + losses);
    plan_.params.track = track_;
    UseCrs();
    UseTimes();
    UseZ();
    ExpectPoints();
    return std::move(plan_);
  }

 private:
  [[noreturn]] void Fail(const std::string& why) const {
    throw DataError(path_.string() + ": " + why);
  }
  std::string NotesName() const { return ColumnsFileOf(path_).filename().string(); }

  void UseCrs() {
    const bool degrees = figures_.box.min()
                                 .head<2>()
                                 .cwiseAbs()
                                 .cwiseMax(figures_.box.max().head<2>().cwiseAbs())
                                 .y() <= 90.0 &&
                         std::max(-figures_.box.min().x(), figures_.box.max().x()) <= 360.0;
    std::string crs = notes_.crs;
    if (crs.empty() && las_) crs = las_->crs;
    if (crs.empty() && (degrees || (xyz_ && HasColumns(xyz_->columns, {"longitude"}))))
      crs = kWgs84;
    if (crs.empty())
      Fail("its coordinates are in a grid that it does not name; state it in " + NotesName() +
           ", such as crs: EPSG:32632");
    try {
      plan_.params.to_geographic = std::make_shared<GeographicConverter>(crs);
    } catch (const std::runtime_error& e) {
      Fail(e.what());
    }
    Describe(crs == kWgs84 ? "longitude and latitude" : plan_.params.to_geographic->name());
  }

  void Describe(const std::string& what) { plan_.text += (plan_.text.empty() ? "" : "; ") + what; }

  bool IsTimed() const { return 2 * figures_.with_time >= figures_.points; }

  // Of each block the first point, which has a time of its own; without times the mean.
  struct Placed {
    std::uint16_t line;
    Eigen::Vector2d p_map_m;
    double z;
    double time_s;
  };
  std::vector<Placed> PlacedBlocks() const {
    std::vector<Placed> placed;
    for (const auto& [line, blocks] : figures_.lines)
      for (const Block& block : blocks.all()) {
        if (IsTimed() && !block.first.time_s) continue;
        const Eigen::Vector3d p = IsTimed() ? block.first.p : block.Mean();
        std::vector<Eigen::Vector2d> place{p.head<2>()};
        plan_.params.to_geographic->Convert(&place);
        if (place[0].allFinite())
          placed.push_back({line,
                            track_->ToMap({place[0].x(), place[0].y()}),
                            p.z(),
                            block.first.time_s.value_or(0.0)});
      }
    return placed;
  }

  void UseTimes() {
    blocks_ = PlacedBlocks();
    if (!IsTimed()) return UseNearest();
    if (xyz_) {
      plan_.params.time_zero = Time{};
      Describe("times of the file");
    } else {
      UseGpsTimes();
    }
    const auto at = [this](double s) { return *plan_.params.time_zero + FromSeconds(s); };
    plan_.begin = at(figures_.first_s);
    const TrackPart whole = track_->whole();
    if (at(figures_.last_s) < whole.begin || *plan_.begin > whole.end)
      Fail("its times, " + IsoTime(*plan_.begin) + " to " + IsoTime(at(figures_.last_s)) +
           ", are not those of the track, " + IsoTime(whole.begin) + " to " + IsoTime(whole.end));
  }

  void UseGpsTimes() {
    const auto zero_of = [](double gps_s, Time near) {
      const double leap_s = GpsSeconds(near) - ToSeconds(near - kGpsEpoch);
      return kGpsEpoch + FromSeconds(gps_s - leap_s);
    };
    Time& zero = plan_.params.time_zero.emplace();
    // Times of a week are shorter: a writer has forgotten the bit.
    if (las_->adjusted_time || figures_.last_s > 2.0 * kGpsWeekS) {
      zero = zero_of(kAdjusted_s, kGpsEpoch + FromSeconds(kAdjusted_s + figures_.first_s));
      Describe("GPS time");
    } else {
      const Time begin = track_->whole().begin;
      const double week = std::round((GpsSeconds(begin) - figures_.first_s) / kGpsWeekS);
      zero = zero_of(week * kGpsWeekS, begin);
      Describe("seconds of the GPS week");
    }
    const double leap_s =
        GpsSeconds(track_->whole().begin) - ToSeconds(track_->whole().begin - kGpsEpoch);
    const auto gps_m = MedianAhead(zero);
    const auto utc_m = MedianAhead(zero + FromSeconds(leap_s));
    constexpr double kLeastM = 5.0;
    if (!gps_m || !utc_m || *gps_m <= kLeastM || *utc_m >= 0.5 * *gps_m) return;
    zero += FromSeconds(leap_s);
    Describe("which is UTC, as the places of the soundings show");
  }

  // Median distance of soundings ahead of the vehicle or behind it.
  std::optional<double> MedianAhead(Time zero) const {
    std::vector<double> ahead_m;
    for (const Placed& block : blocks_) {
      const auto vehicle = track_->At(zero + FromSeconds(block.time_s));
      if (!vehicle) continue;
      const Eigen::Vector2d off = block.p_map_m - vehicle->p_north_east_m;
      ahead_m.push_back(std::abs(std::cos(vehicle->heading_rad) * off.x() +
                                 std::sin(vehicle->heading_rad) * off.y()));
    }
    return ahead_m.empty() ? std::nullopt : std::optional(Median(ahead_m));
  }

  // The part of the track along which most blocks of a line lie, one after the other.
  void UseNearest() {
    std::map<std::uint16_t, std::vector<Time>> times;
    for (const Placed& block : blocks_)
      if (const auto t = track_->TimeNearest(block.p_map_m, track_->whole()))
        times[block.line].push_back(*t);
    for (const auto& [line, of_line] : times) {
      const TrackPart part = Densest(of_line);
      plan_.params.parts[line] = part;
      if (!plan_.begin || part.begin < *plan_.begin) plan_.begin = part.begin;
    }
    Describe("without times: by the nearest place of the track");
  }

  static TrackPart Densest(std::vector<Time> times) {
    std::vector<double> steps_s{0.0};
    for (std::size_t i = 1; i < times.size(); ++i)
      steps_s.push_back(std::abs(ToSeconds(times[i] - times[i - 1])));
    const double step_s = Median(steps_s);
    const Duration gap = FromSeconds(std::max(60.0, 4.0 * step_s));
    std::sort(times.begin(), times.end());
    std::size_t begin = 0, best = 0, most = 0;
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (i > 0 && times[i] - times[i - 1] > gap) begin = i;
      if (i - begin + 1 > most) most = i - begin + 1, best = begin;
    }
    const Duration margin = FromSeconds(1.0 + 2.0 * step_s);
    return {times[best] - margin, times[best + most - 1] + margin};
  }

  std::optional<Time> TimeOf(const Placed& block) const {
    if (plan_.params.time_zero) return *plan_.params.time_zero + FromSeconds(block.time_s);
    const auto part = plan_.params.parts.find(block.line);
    return part == plan_.params.parts.end() ? std::nullopt
                                            : track_->TimeNearest(block.p_map_m, part->second);
  }

  void UseZ() {
    std::vector<double> zs, depths_m;
    for (const Placed& block : blocks_) {
      const auto t = TimeOf(block);
      const auto vehicle = t ? track_->At(*t) : std::nullopt;
      if (!vehicle) continue;
      zs.push_back(block.z);
      depths_m.push_back(vehicle->depth_m);
    }
    const auto [least, most] = std::minmax_element(zs.begin(), zs.end());
    const double z = zs.empty() ? 0.0 : Median(zs);
    const double depth_m = depths_m.empty() ? 0.0 : Median(depths_m);
    double unit_m = 1.0;
    ZAxis axis = notes_.z;
    const bool stated = axis != ZAxis::kNotStated;
    if (las_) {
      unit_m = las_->z_unit_m.value_or(plan_.params.to_geographic->z_unit_m());
      if (!stated) axis = plan_.params.to_geographic->z_is_down() ? ZAxis::kDown : ZAxis::kUp;
    } else if (unit_m = UnitOfColumns(); !HasColumns(xyz_->columns, {"z"})) {
      axis = HasColumns(xyz_->columns, {"depth"}) ? ZAxis::kDown : ZAxis::kUp;
    } else if (!stated) {
      axis = -z * unit_m > depth_m ? ZAxis::kUp : ZAxis::kDown;
    }
    if (notes_.z_unit != LengthUnit::kNotStated) unit_m = MetresOf(notes_.z_unit);
    plan_.params.depth_per_z = axis == ZAxis::kUp ? -unit_m : unit_m;
    if (!las_ && unit_m != 1.0 && notes_.z_unit == LengthUnit::kNotStated && !zs.empty()) {
      char text[160];
      std::snprintf(text,
                    sizeof text,
                    "depths are taken in the unit of its grid, %.6f m: %.2f to %.2f m; if that is "
                    "wrong, state z_unit in ",
                    unit_m,
                    std::min(std::abs(*least), std::abs(*most)) * unit_m,
                    std::max(std::abs(*least), std::abs(*most)) * unit_m);
      plan_.warning = text + NotesName();
    }
    if (!stated && plan_.params.depth_per_z * z < depth_m)
      Fail("its soundings lie above the vehicle; if its z grows the other way, state it in " +
           NotesName() + ": z: " + (axis == ZAxis::kUp ? "down" : "up"));
    Describe(axis == ZAxis::kUp ? "z up" : "z down");
  }

  // Unit of z, depth or height of text: that of the grid, unless its column is scaled already.
  double UnitOfColumns() const {
    for (const TextColumn& column : xyz_->columns)
      if ((column.quantity == "z" || column.quantity == "depth" || column.quantity == "height") &&
          column.scale != 1.0)
        return 1.0;
    return plan_.params.to_geographic ? plan_.params.to_geographic->z_unit_m() : 1.0;
  }

  static double MetresOf(LengthUnit unit) {
    constexpr double kFootM = 0.3048;
    constexpr double kUsFootM = 1200.0 / 3937.0;
    return unit == LengthUnit::kFoot ? kFootM : unit == LengthUnit::kUsFoot ? kUsFootM : 1.0;
  }

  // At least one block lies within a swath's reach of the track.
  void ExpectPoints() {
    std::size_t near = 0;
    for (const Placed& block : blocks_) {
      const auto t = TimeOf(block);
      const auto vehicle = t ? track_->At(*t) : std::nullopt;
      if (!vehicle) continue;
      const double below_m = plan_.params.depth_per_z * block.z - vehicle->depth_m;
      if ((block.p_map_m - vehicle->p_north_east_m).norm() <= SwathReach(below_m)) ++near;
    }
    if (near > 0 && near < blocks_.size())
      Describe(std::to_string(blocks_.size() - near) + " of " + std::to_string(blocks_.size()) +
               " parts of it are away from the track");
    if (near > 0) return;
    Fail("none of its " + std::to_string(figures_.points) +
         " soundings lies within a swath's reach of the track");
  }

  const fs::path path_;
  const std::shared_ptr<const LineTrack> track_;
  const FileNotes notes_;
  std::optional<LasHead> las_;
  std::optional<XyzFormat> xyz_;
  Summary::Figures figures_;
  std::vector<Placed> blocks_;
  LinePlan plan_;
};

}  // namespace

std::unique_ptr<SurveyReader> LineReader(const fs::path& path, std::unique_ptr<LinePoints> points) {
  if (IsLas(path)) return std::make_unique<LasFileReader>(std::move(points));
  return std::make_unique<XyzFileReader>(FormatOf(path), std::move(points));
}

LinePlan PlanLine(const fs::path& path, std::shared_ptr<const LineTrack> track) {
  return Planner(path, std::move(track)).Plan();
}

std::optional<Time> FirstTimeOf(const fs::path& line) {
  std::string losses;
  const Summary::Figures figures = FiguresOf(line, 1'000'000, &losses);
  if (figures.with_time == 0) return std::nullopt;
  if (!IsLas(line)) return Time(FromSeconds(figures.first_s));
  if (!HeadOf(line).adjusted_time) return std::nullopt;
  const Time gps = kGpsEpoch + FromSeconds(kAdjusted_s + figures.first_s);
  return gps - FromSeconds(GpsSeconds(gps) - ToSeconds(gps - kGpsEpoch));
}

}  // namespace seastitch
