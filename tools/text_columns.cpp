#include "tools/text_columns.hpp"

#include <string>
#include <utility>
#include <vector>

#include "common/runtime/parameters.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct ColumnEntry {
  std::string quantity;
  int column = 0;  // from 1
  double scale = 1.0;
};

struct ColumnsFile {
  char delimiter = ',';
  int header_lines = 0;
  std::string comment = "#";
  std::vector<ColumnEntry> columns;
};

void DeclareColumn(ColumnEntry* entry, ParameterTable* table) {
  table
      ->Add("quantity",
            &entry->quantity,
            "epoch, iso, date, clock, year, month, day, hour, minute, second; latitude, longitude, "
            "north, east, depth, height, heading, roll, pitch, heave.")
      .Required();
  table->Add("column", &entry->column, Unit::kNone, Range::Within(1, 1000), "Its number, from 1.")
      .Required();
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
  table.AddList("columns", &file->columns, DeclareColumn, "What the columns hold.");
  return table;
}

}  // namespace

fs::path ColumnsFileOf(const fs::path& text) { return text.string() + ".yaml"; }

TextNavigationFormat LoadTextColumns(const fs::path& path) {
  ColumnsFile file;
  TableOf(&file).Load(path.string());
  TextNavigationFormat format;
  format.delimiter = file.delimiter;
  format.header_lines = static_cast<std::size_t>(file.header_lines);
  if (file.comment.size() > 1)
    throw ConfigError(path.string() + ": comment: '" + file.comment + "' is not one letter");
  format.comment = file.comment.empty() ? '\0' : file.comment[0];
  for (const ColumnEntry& entry : file.columns)
    format.columns.push_back(
        {entry.quantity, static_cast<std::size_t>(entry.column - 1), entry.scale});
  if (const std::string problem = format.Validate(); !problem.empty())
    throw ConfigError(path.string() + ": columns: " + problem);
  return format;
}

}  // namespace seastitch
