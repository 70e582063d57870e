#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/submap.hpp"
#include "common/geo/datum.hpp"
#include "mapper/mapper.hpp"
#include "products/report/dive_report.hpp"
#include "products/survey.hpp"
#include "products/write_products.hpp"

// The map of an earlier replay as an input of another. Its folder holds the points (submaps/) and
// the file survey.bin: what the graph was made of, and what other products need.
namespace seastitch {

inline constexpr char kFinishedMapFile[] = "survey.bin";

// Names and texts of configuration files.
using ConfigTexts = std::vector<std::pair<std::string, std::string>>;

// Records a mapper's submaps, registrations and graph: its journal, without checkpoints.
class MapRecorder {
 public:
  void Add(const MapperEvent& event);
  const std::vector<std::vector<std::uint8_t>>& journal() const { return journal_; }

 private:
  std::vector<std::vector<std::uint8_t>> journal_;  // Encode() of each entry
};

// Writes survey.bin into a folder that holds the products already. Throws std::runtime_error naming
// the file.
void WriteFinishedMap(const std::filesystem::path& folder,
                      const MapRecorder& recorder,
                      const Survey& survey,
                      const ProductOptions& products,
                      Outcome outcome,
                      const ConfigTexts& configuration);

struct FinishedPoints {
  std::filesystem::path file;  // PCD
  std::uint32_t crc = 0;       // CRC-32 of the file as the replay wrote it
  double dvl_yaw_rad = 0.0;    // angle by which they are sheared: SurveyPoses::ShearOf()
};

struct FinishedSubmap {
  Submap submap;  // dead reckoned, without its points
  Mapper::OfDive dive;
  std::optional<FinishedPoints> points;  // absent: it has none
};

struct FinishedDive {
  std::string name;
  DiveReport report;
};

struct FinishedMap {
  std::string program_version;
  Datum datum;
  std::vector<FinishedDive> dives;
  std::vector<FinishedSubmap> submaps;  // by rising id, dives one after the other
  std::vector<TrackState> track;        // dead reckoned; dives one after the other
  std::vector<SurveyInput> inputs;
  std::vector<UnreadDive> unread;
  std::map<std::string, std::int64_t> refused;  // messages that never reached a mapper, by reason
  ConfigTexts configuration;
};

// Whether a folder holds the products of a replay, of this version or another.
bool IsFinishedMap(const std::filesystem::path& folder);

// name: of the map, for the names of its dives. Throws DataError in one line where the map cannot
// be an input: without survey.bin, damaged, of another version, or without a map origin.
FinishedMap ReadFinishedMap(const std::filesystem::path& folder, const std::string& name);

// Points of a submap as they were before the graph sheared them. Throws std::runtime_error naming a
// file that is missing, or not as the replay wrote it.
PointCloud LoadPoints(const FinishedSubmap& submap);

// Moves the map to another map origin: by one translation and rotation, which keep the latitude and
// longitude of its first submap and the direction of north there.
void MoveTo(const Datum& datum, FinishedMap* map);

// Adds to all numbers of submaps and dives.
void Renumber(std::int32_t first_submap, std::int32_t first_dive, FinishedMap* map);

}  // namespace seastitch
