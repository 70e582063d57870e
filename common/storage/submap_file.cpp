#include "common/storage/submap_file.hpp"

#include <fcntl.h>
#include <pcl/io/lzf.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <limits>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/storage/crc32.hpp"

// Own reader and writer of PCD. PCL's PCDWriter writes VIEWPOINT with six digits (10 cm at 12 km),
// and its reader allocates as much as a header claims. The tests compare both with PCL.
namespace seastitch {
namespace {

constexpr std::size_t kMaxPoints = 20'000'000;
constexpr std::uintmax_t kMaxFileSize = std::uintmax_t{1} << 30;
constexpr std::size_t kMaxHeaderSize = 16'384;
constexpr std::size_t kMaxFields = 64;
constexpr std::size_t kMaxPointSize = 4096;
// First line of our files.
constexpr char kFormatLine[] = "# .PCD v0.7 - Point Cloud Data file format\n";
// Then this, with eight hexadecimal digits.
constexpr char kChecksumLine[] = "# CRC-32 of the lines and points below: ";

// One element of a point: its position and its type in the file.
struct Field {
  std::string name;
  char type = 'F';         // F float, I signed, U unsigned
  std::size_t size = 4;    // bytes of one element
  std::size_t count = 1;   // elements
  std::size_t offset = 0;  // within a point [bytes]
  std::size_t column = 0;  // of its first element, in ASCII files
};

enum class DataKind { kAscii, kBinary, kCompressed };

struct Header {
  std::vector<Field> fields;
  std::size_t points = 0;
  std::size_t point_size = 0;
  std::size_t columns = 0;
  DataKind data = DataKind::kAscii;
  std::size_t size = 0;  // bytes of the header itself
  Eigen::Isometry3d T_map_submap = Eigen::Isometry3d::Identity();

  const Field* Find(const std::string& name) const {
    for (const Field& field : fields)
      if (field.name == name) return &field;
    return nullptr;
  }
};

// An error with the reason only; ReadSubmapPcd adds the file name.
std::runtime_error Refused(const std::string& reason) { return std::runtime_error(reason); }

std::vector<std::string_view> Words(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r";
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
  return words;
}

// Takes the next line from the front of `text`.
std::string_view TakeLine(std::string_view* text) {
  const std::size_t end = std::min(text->find('\n'), text->size());
  const std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(end + 1, text->size()));
  return line;
}

template <class Number>
std::optional<Number> NumberFrom(std::string_view word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::size_t CountFrom(std::string_view word, std::size_t most, const std::string& key) {
  const auto value = NumberFrom<std::size_t>(word);
  if (!value || *value > most)
    throw Refused(key + " '" + std::string(word.substr(0, 30)) + "' is not a number up to " +
                  std::to_string(most));
  return *value;
}

// The words of each header line, by its first word.
using HeaderLines = std::map<std::string, std::vector<std::string_view>>;

HeaderLines ReadHeaderLines(std::string_view file, std::size_t* header_size) {
  HeaderLines lines;
  std::string_view rest = file.substr(0, kMaxHeaderSize);
  while (!rest.empty()) {
    std::vector<std::string_view> words = Words(TakeLine(&rest));
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string key(words[0]);
    words.erase(words.begin());
    if (!lines.emplace(key, words).second) throw Refused("has two lines " + key.substr(0, 30));
    if (key == "DATA") {
      *header_size = std::min(file.size(), kMaxHeaderSize) - rest.size();
      return lines;
    }
  }
  throw Refused("is not a PCD file: no DATA line");
}

const std::vector<std::string_view>& Line(const HeaderLines& lines,
                                          const std::string& key,
                                          std::size_t words) {
  const auto found = lines.find(key);
  if (found == lines.end()) throw Refused("has no line " + key);
  if (found->second.size() != words)
    throw Refused("line " + key + " has " + std::to_string(found->second.size()) +
                  " values, expected " + std::to_string(words));
  return found->second;
}

bool IsReadable(const Field& field) {
  const std::size_t size = field.size;
  if (field.type == 'F') return size == 4 || size == 8;
  return (field.type == 'I' || field.type == 'U') &&
         (size == 1 || size == 2 || size == 4 || size == 8);
}

void ReadFields(const HeaderLines& lines, Header* header) {
  const auto names = lines.find("FIELDS");
  if (names == lines.end()) throw Refused("has no line FIELDS");
  const std::size_t n = names->second.size();
  if (n > kMaxFields) throw Refused("has " + std::to_string(n) + " fields");
  const auto& sizes = Line(lines, "SIZE", n);
  const auto& types = Line(lines, "TYPE", n);
  const auto* counts = lines.contains("COUNT") ? &Line(lines, "COUNT", n) : nullptr;
  for (std::size_t i = 0; i < n; ++i) {
    Field field;
    field.name = names->second[i];
    field.size = CountFrom(sizes[i], 8, "SIZE");
    field.type = types[i].size() == 1 ? types[i][0] : '?';
    field.count = counts != nullptr ? CountFrom((*counts)[i], kMaxPointSize, "COUNT") : 1;
    field.offset = header->point_size;
    field.column = header->columns;
    if (!IsReadable(field))
      throw Refused("field " + field.name.substr(0, 30) + " has no known type");
    header->point_size += field.size * field.count;
    header->columns += field.count;
    if (header->point_size > kMaxPointSize) throw Refused("a point has too many bytes");
    header->fields.push_back(field);
  }
  for (const char* axis : {"x", "y", "z"})
    if (const Field* field = header->Find(axis); field == nullptr || field->count != 1)
      throw Refused(std::string("has no field ") + axis);
}

// x y z qw qx qy qz, as double; PCL uses float.
Eigen::Isometry3d ReadViewpoint(const HeaderLines& lines) {
  if (!lines.contains("VIEWPOINT")) return Eigen::Isometry3d::Identity();
  double v[7];
  const auto& words = Line(lines, "VIEWPOINT", 7);
  for (std::size_t i = 0; i < 7; ++i) {
    const auto value = NumberFrom<double>(words[i]);
    if (!value || !std::isfinite(*value)) throw Refused("VIEWPOINT is not seven numbers");
    v[i] = *value;
  }
  const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
  // The tolerance covers files of other programs, which print six digits.
  if (!(std::abs(q.norm() - 1.0) < 1e-3)) throw Refused("VIEWPOINT is not a rotation");
  return MakePose({v[0], v[1], v[2]}, q.normalized().toRotationMatrix());
}

DataKind ReadDataKind(std::string_view word) {
  if (word == "ascii") return DataKind::kAscii;
  if (word == "binary") return DataKind::kBinary;
  if (word == "binary_compressed") return DataKind::kCompressed;
  throw Refused("DATA '" + std::string(word.substr(0, 30)) +
                "' is not ascii, binary or binary_compressed");
}

Header ReadHeader(std::string_view file) {
  Header header;
  const HeaderLines lines = ReadHeaderLines(file, &header.size);
  ReadFields(lines, &header);
  const std::size_t width = CountFrom(Line(lines, "WIDTH", 1)[0], kMaxPoints, "WIDTH");
  const std::size_t height = CountFrom(Line(lines, "HEIGHT", 1)[0], kMaxPoints, "HEIGHT");
  header.points = width * height;
  if (header.points > kMaxPoints) throw Refused("has more than 20 million points");
  if (lines.contains("POINTS") &&
      CountFrom(Line(lines, "POINTS", 1)[0], kMaxPoints, "POINTS") != header.points)
    throw Refused("POINTS is not WIDTH x HEIGHT");
  header.data = ReadDataKind(Line(lines, "DATA", 1)[0]);
  header.T_map_submap = ReadViewpoint(lines);
  return header;
}

template <class Number>
double As(Bytes bytes) {
  return static_cast<double>(ByteReader(bytes).Le<Number>());
}

double ElementFrom(const Field& field, Bytes bytes) {
  const bool is_signed = field.type == 'I';
  if (field.type == 'F') return field.size == 4 ? As<float>(bytes) : As<double>(bytes);
  switch (field.size) {
    case 1: return is_signed ? As<std::int8_t>(bytes) : As<std::uint8_t>(bytes);
    case 2: return is_signed ? As<std::int16_t>(bytes) : As<std::uint16_t>(bytes);
    case 4: return is_signed ? As<std::int32_t>(bytes) : As<std::uint32_t>(bytes);
    default: return is_signed ? As<std::int64_t>(bytes) : As<std::uint64_t>(bytes);
  }
}

// Adds a point if its coordinates are finite.
void AddPoint(double x, double y, double z, double soundings, PointCloud* cloud) {
  const Eigen::Vector3f p = Eigen::Vector3d(x, y, z).cast<float>();
  const auto n = static_cast<float>(soundings);
  if (p.allFinite()) cloud->Add(p, n > 0.0f && std::isfinite(n) ? n : 1.0f);
}

// `value(field, i)` gives a field of point i.
template <class Value>
PointCloud CollectPoints(const Header& header, const Value& value) {
  const Field& x = *header.Find("x");
  const Field& y = *header.Find("y");
  const Field& z = *header.Find("z");
  const Field* intensity = header.Find("intensity");
  PointCloud cloud;
  cloud.points.reserve(header.points);
  cloud.soundings.reserve(header.points);
  for (std::size_t i = 0; i < header.points; ++i)
    AddPoint(value(x, i),
             value(y, i),
             value(z, i),
             intensity != nullptr && intensity->count == 1 ? value(*intensity, i) : 1.0,
             &cloud);
  return cloud;
}

PointCloud ReadAscii(const Header& header, std::string_view body) {
  // Each value takes at least two bytes, a digit and a blank: refuses a count that the file is too
  // short for.
  if (header.points * header.columns > body.size()) throw Refused("ends before its last point");
  std::vector<std::string_view> words;
  std::size_t line_of_words = std::numeric_limits<std::size_t>::max();
  return CollectPoints(header, [&](const Field& field, std::size_t i) {
    if (line_of_words != i) {
      do {
        if (body.empty()) throw Refused("ends before its last point");
        words = Words(TakeLine(&body));
      } while (words.empty());
      line_of_words = i;
      if (words.size() != header.columns)
        throw Refused("point " + std::to_string(i) + " has " + std::to_string(words.size()) +
                      " values, expected " + std::to_string(header.columns));
    }
    const auto value = NumberFrom<double>(words[field.column]);
    if (!value) throw Refused("point " + std::to_string(i) + " is not a number");
    return *value;
  });
}

PointCloud ReadBinary(const Header& header, Bytes body) {
  if (header.points * header.point_size > body.size()) throw Refused("ends before its last point");
  const bool are_floats =  // as in our own files
      std::all_of(header.fields.begin(), header.fields.end(), [](const Field& field) {
        return field.type == 'F' && field.size == 4;
      });
  if (are_floats)
    return CollectPoints(header, [&](const Field& field, std::size_t i) {
      return As<float>(body.subspan(i * header.point_size + field.offset, sizeof(float)));
    });
  return CollectPoints(header, [&](const Field& field, std::size_t i) {
    return ElementFrom(field, body.subspan(i * header.point_size + field.offset, field.size));
  });
}

// One field after the other, LZF-compressed, preceded by two u32 lengths.
PointCloud ReadCompressed(const Header& header, Bytes body) {
  constexpr std::size_t kLzfBestRatio = 300;  // limit of LZF's compression
  ByteReader in(body);
  const std::size_t packed_size = in.Le<std::uint32_t>();
  const std::size_t size = in.Le<std::uint32_t>();
  const Bytes packed = in.Take(packed_size);
  if (!in.ok()) throw Refused("ends before its last point");
  if (size != header.points * header.point_size || size > packed_size * kLzfBestRatio)
    throw Refused("holds another number of points than its header says");
  std::vector<std::uint8_t> unpacked(size);
  if (size > 0 && pcl::lzfDecompress(packed.data(),
                                     static_cast<unsigned>(packed_size),
                                     unpacked.data(),
                                     static_cast<unsigned>(size)) != size)
    throw Refused("compressed points are damaged");
  return CollectPoints(header, [&](const Field& field, std::size_t i) {
    const std::size_t stride = field.size * field.count;
    const std::size_t begin = field.offset * header.points + i * stride;
    return ElementFrom(field, Bytes(unpacked).subspan(begin, field.size));
  });
}

std::string ReadFile(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) throw Refused("no such file");
  if (std::filesystem::file_size(path) > kMaxFileSize) throw Refused("is larger than 1 GiB");
  std::string bytes(std::filesystem::file_size(path), '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw Refused("cannot be read");
  return bytes;
}

// Throws where the file has a checksum that is not that of its content. Files of other programs,
// and those of before, have none.
void CheckChecksum(std::string_view file) {
  std::string_view rest = file;
  TakeLine(&rest);
  std::string_view line = TakeLine(&rest);
  if (!line.starts_with(kChecksumLine)) return;
  line.remove_prefix(sizeof kChecksumLine - 1);
  std::uint32_t stated = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), stated, 16);
  if (error != std::errc() || end != line.data() + line.size() || stated != Crc32(AsBytes(rest)))
    throw Refused("is damaged: its content is not that of its checksum");
}

SubmapPcd Parse(std::string_view file) {
  CheckChecksum(file);
  const Header header = ReadHeader(file);
  const std::string_view body = file.substr(header.size);
  const Bytes bytes = AsBytes(body);
  SubmapPcd pcd;
  pcd.T_map_submap = header.T_map_submap;
  switch (header.data) {
    case DataKind::kAscii: pcd.cloud = ReadAscii(header, body); break;
    case DataKind::kBinary: pcd.cloud = ReadBinary(header, bytes); break;
    case DataKind::kCompressed: pcd.cloud = ReadCompressed(header, bytes); break;
  }
  return pcd;
}

std::string HeaderText(std::size_t points, const Eigen::Isometry3d& T_map_submap) {
  const Eigen::Vector3d p = T_map_submap.translation();
  const Eigen::Quaterniond q(T_map_submap.linear());
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH "
      << points << "\nHEIGHT 1\n"
      << std::setprecision(17) << "VIEWPOINT " << p.x() << ' ' << p.y() << ' ' << p.z() << ' '
      << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << "\nPOINTS " << points
      << "\nDATA binary\n";
  return out.str();
}

std::vector<std::uint8_t> Body(const PointCloud& cloud) {
  ByteWriter out;
  out.Reserve(4 * sizeof(float) * cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (const float value : cloud.points[i]) out.Le(value);
    out.Le(cloud.soundings[i]);
  }
  return out.Release();
}

// Flushes a file to disk. A rename that reached the disk before the bytes would leave an empty file
// after a power cut.
bool Sync(const std::filesystem::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && fsync(fd) == 0;
  if (fd >= 0) close(fd);
  return synced;
}

}  // namespace

void WriteSubmapPcd(const std::filesystem::path& path,
                    const PointCloud& cloud,
                    const Eigen::Isometry3d& T_map_submap,
                    PowerCut power_cut) {
  const std::filesystem::path temporary = path.string() + ".part";
  std::string content = HeaderText(cloud.size(), T_map_submap);
  const std::vector<std::uint8_t> body = Body(cloud);
  content.append(body.begin(), body.end());
  char checksum[9];
  std::snprintf(checksum, sizeof checksum, "%08x", Crc32(AsBytes(content)));
  errno = 0;
  std::ofstream out(temporary, std::ios::binary);
  out << kFormatLine << kChecksumLine << checksum << '\n';
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  out.close();
  std::error_code error;
  if (out && (power_cut == PowerCut::kMayLoseFile || Sync(temporary)))
    std::filesystem::rename(temporary, path, error);
  else
    error.assign(errno != 0 ? errno : EIO, std::generic_category());
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw std::runtime_error(path.string() + ": cannot be written: " + error.message());
  }
}

SubmapPcd ReadSubmapPcd(const std::filesystem::path& path) {
  try {
    return Parse(ReadFile(path));
  } catch (const std::exception& e) {
    throw std::runtime_error(path.string() + ": " + e.what());
  }
}

}  // namespace seastitch
