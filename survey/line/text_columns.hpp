#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "codecs/navigation/text_navigation.hpp"

namespace seastitch {

// The file that describes the columns of a text file: NAME.yaml beside NAME.
std::filesystem::path ColumnsFileOf(const std::filesystem::path& text);

enum class ZAxis : std::uint8_t { kNotStated, kUp, kDown };
enum class LengthUnit : std::uint8_t { kNotStated, kMetre, kFoot, kUsFoot };

// What that file states.
struct FileNotes {
  char delimiter = ',';
  std::size_t header_lines = 0;
  char comment = '#';  // NUL: none
  std::vector<TextColumn> columns;
  bool soundings = false;  // the text holds soundings; else navigation
  std::string crs;         // of coordinates in a grid
  ZAxis z = ZAxis::kNotStated;
  LengthUnit z_unit = LengthUnit::kNotStated;  // of z, depth or height of soundings
};

// Reads it. Names of columns are looked up in the last header line of the text. Throws ConfigError.
FileNotes LoadFileNotes(const std::filesystem::path& file);
// True for soundings by line: LAS, text named .xyz, and text whose FileNotes call it soundings.
bool IsLineFile(const std::filesystem::path& path);
// True for text of navigation whose columns that file describes, and for the navigation.csv of a
// replay, which needs none.
bool HasTextColumns(const std::filesystem::path& text);
// Its format. Throws ConfigError.
TextNavigationFormat LoadTextColumns(const std::filesystem::path& text);

}  // namespace seastitch
