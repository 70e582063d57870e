#include "survey/line/text_columns.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "codecs/text.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "products/files/navigation_files.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct ColumnEntry {
  std::string quantity;
  int column = 0;    // from 1
  std::string name;  // instead
  double scale = 1.0;
};

struct ColumnsFile {
  char delimiter = ',';
  int header_lines = 0;
  std::string comment = "#";
  std::vector<ColumnEntry> columns;
  bool soundings = false;
  std::string crs;
  ZAxis z = ZAxis::kNotStated;
  LengthUnit z_unit = LengthUnit::kNotStated;
};

void DeclareColumn(ColumnEntry* entry, ParameterTable* table) {
  table
      ->Add("quantity",
            &entry->quantity,
            "epoch, iso, date, clock, year, month, day, hour, minute, second; latitude, longitude, "
            "north, east, depth, height, heading, roll, pitch, heave; of soundings also z, line, "
            "used.")
      .Required();
  table->Add("column",
             &entry->column,
             Unit::kNone,
             Range::Within(0, 1000),
             "Its number, from 1; or its name:");
  table->Add("name", &entry->name, "As the last header line has it.");
  table->Add("scale",
             &entry->scale,
             Unit::kNone,
             Range::Any(),
             "The value is the text times this: unit and sign.");
}

ParameterTable TableOf(ColumnsFile* file) {
  ParameterTable table;
  table.AddChoice<char>("delimiter",
                        &file->delimiter,
                        {{"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"blank", ' '}},
                        "Between columns; blank: any run of blanks and tabs.");
  table.Add("header_lines",
            &file->header_lines,
            Unit::kNone,
            Range::Within(0, 1000),
            "At the beginning, left out.");
  table.Add("comment", &file->comment, "Lines that begin so are left out: one letter, or none.");
  table.Add("soundings", &file->soundings, "It holds soundings; else navigation.");
  table.Add(
      "crs",
      &file->crs,
      "Coordinate reference system of east and north (of a LAS file: of x and y): EPSG:32632, "
      "WKT or PROJ.");
  table.AddChoice<ZAxis>(
      "z",
      &file->z,
      {{"not_stated", ZAxis::kNotStated}, {"up", ZAxis::kUp}, {"down", ZAxis::kDown}},
      "Direction in which z of soundings grows.");
  table.AddChoice<LengthUnit>("z_unit",
                              &file->z_unit,
                              {{"not_stated", LengthUnit::kNotStated},
                               {"m", LengthUnit::kMetre},
                               {"ft", LengthUnit::kFoot},
                               {"us-ft", LengthUnit::kUsFoot}},
                              "Unit of z, depth or height of soundings; ft: 0.3048 m, us-ft: "
                              "1200/3937 m. Not stated: that of the grid.");
  table.AddList("columns", &file->columns, DeclareColumn, "What the columns hold.");
  return table;
}

// The last header line, as columns without blanks and quotation marks.
std::vector<std::string> HeaderOf(const fs::path& text, const ColumnsFile& file) {
  std::ifstream in(text);
  std::string line;
  for (int i = 0; i < file.header_lines; ++i) std::getline(in, line);
  if (!file.comment.empty() && line.starts_with(file.comment)) line.erase(0, file.comment.size());
  std::vector<std::string> names;
  for (std::string_view name : TextColumns(line, file.delimiter)) {
    name = Trimmed(name);
    if (name.size() > 1 && name.starts_with('"') && name.ends_with('"'))
      name = name.substr(1, name.size() - 2);
    names.emplace_back(name);
  }
  return names;
}

// Place of a column, from 0. header: names of the columns.
std::size_t PlaceOf(const ColumnEntry& entry, const std::vector<std::string>& header) {
  if ((entry.column > 0) != entry.name.empty())
    throw ConfigError("columns: " + entry.quantity + ": needs either its column or its name");
  if (entry.column > 0) return static_cast<std::size_t>(entry.column - 1);
  const auto found = std::find(header.begin(), header.end(), entry.name);
  if (found == header.end())
    throw ConfigError("columns: the last header line has no '" + entry.name + "'");
  return static_cast<std::size_t>(found - header.begin());
}

}  // namespace

fs::path ColumnsFileOf(const fs::path& text) { return text.string() + ".yaml"; }

FileNotes LoadFileNotes(const fs::path& text) {
  const fs::path path = ColumnsFileOf(text);
  ColumnsFile file;
  LoadParameters(path.string(), TableOf(&file));
  FileNotes notes{file.delimiter,
                  static_cast<std::size_t>(file.header_lines),
                  file.comment.empty() ? '\0' : file.comment[0],
                  {},
                  file.soundings,
                  file.crs,
                  file.z,
                  file.z_unit};
  if (file.comment.size() > 1)
    throw ConfigError(path.string() + ": comment: '" + file.comment + "' is not one letter");
  const std::vector<std::string> header = HeaderOf(text, file);
  try {
    for (const ColumnEntry& entry : file.columns)
      notes.columns.push_back({entry.quantity, PlaceOf(entry, header), entry.scale});
  } catch (const ConfigError& e) {
    throw ConfigError(path.string() + ": " + e.what());
  }
  return notes;
}

bool IsLineFile(const fs::path& path) {
  constexpr std::array<char, 4> kLas{'L', 'A', 'S', 'F'};
  std::array<char, 4> begin{};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  return begin == kLas || path.extension() == ".xyz" || path.extension() == ".XYZ" ||
         (fs::exists(ColumnsFileOf(path)) && LoadFileNotes(path).soundings);
}

bool IsExportedNavigation(const fs::path& text) {
  std::string heading(kNavigationCsvHeading.size(), '\0');
  std::ifstream(text, std::ios::binary)
      .read(heading.data(), static_cast<std::streamsize>(heading.size()));
  return heading == kNavigationCsvHeading;
}

bool HasTextColumns(const fs::path& text) {
  return fs::exists(ColumnsFileOf(text)) ? !IsLineFile(text) : IsExportedNavigation(text);
}

TextNavigationFormat LoadTextColumns(const fs::path& text) {
  if (!fs::exists(ColumnsFileOf(text))) {
    TextNavigationFormat exported;
    exported.delimiter = ',';
    exported.header_lines = 1;
    for (const char* const quantity :
         {"iso", "latitude", "longitude", "depth", "heading", "roll", "pitch"})
      exported.columns.push_back({quantity, exported.columns.size()});
    return exported;
  }
  const FileNotes notes = LoadFileNotes(text);
  TextNavigationFormat format;
  format.delimiter = notes.delimiter;
  format.header_lines = notes.header_lines;
  format.comment = notes.comment;
  format.columns = notes.columns;
  if (const std::string problem = format.Validate(); !problem.empty())
    throw ConfigError(ColumnsFileOf(text).string() + ": columns: " + problem);
  return format;
}

}  // namespace seastitch
