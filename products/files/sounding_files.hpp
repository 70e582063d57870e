#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/geo/datum.hpp"
#include "products/files/sounding_log.hpp"
#include "products/geo/map_projection.hpp"
#include "products/survey.hpp"

namespace seastitch {

enum class SoundingFormat : std::uint8_t {
  // LAS 1.4, point format 6: x east, y north of the projection, z up, millimetres; adjusted GPS
  // time.
  // Used soundings are class 40 (bathymetric point), the others class 7 (noise) and withheld. Point
  // source: the survey line; scanner channel: the head; extra bytes: ping, beam, file.
  kLas,
  // Text: longitude latitude depth (without a datum east north depth), then time, file, line, ping,
  // head, beam, used (1 or 0).
  kXyz,
};

struct SoundingOutput {
  SoundingFormat format = SoundingFormat::kLas;
  const MapProjection& projection;
  std::optional<Datum> datum;  // origin of the map frame, for latitude and longitude
};

// Writes every sounding at its final position in the map. The file appears whole or not at all.
// File numbers are indices into survey.inputs, from 1; lines are those of LinesCsv(). Returns the
// number of soundings. Throws std::runtime_error naming the file.
std::uint64_t WriteSoundings(const Survey& survey,
                             const SurveyPoses& poses,
                             const SoundingOutput& output,
                             SoundingLog* log,
                             const std::filesystem::path& path);

}  // namespace seastitch
