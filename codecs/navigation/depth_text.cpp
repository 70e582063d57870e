#include "codecs/navigation/depth_text.hpp"

#include <algorithm>
#include <cctype>

#include "codecs/text.hpp"

namespace seastitch {
namespace {

using Kind = DepthReading::Kind;

bool IsDbar(std::string_view unit) {
  constexpr std::string_view kDbar = "dbar";
  return std::equal(unit.begin(), unit.end(), kDbar.begin(), kDbar.end(), [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == b;
  });
}

std::optional<DepthReading> WithUnit(std::optional<double> value, std::string_view unit) {
  unit = Trimmed(unit);
  if (!value) return std::nullopt;
  if (unit == "M" || unit == "m") return DepthReading{Kind::kDepthM, *value};
  if (IsDbar(unit)) return DepthReading{Kind::kPressureDbar, *value};
  return std::nullopt;
}

}  // namespace

std::optional<DepthReading> DecodeDepthLine(std::string_view line) {
  line = Trimmed(line);
  if (line.starts_with('*')) {
    constexpr std::size_t kAddresses = 5;  // including the star
    if (line.size() <= kAddresses ||
        line.substr(1, 4).find_first_not_of("0123456789") != std::string_view::npos)
      return std::nullopt;
    const auto value = ParseNumber(Trimmed(line.substr(kAddresses)));
    return value ? std::optional(DepthReading{Kind::kPressure, *value}) : std::nullopt;
  }
  const auto fields = Split(line, ',');
  if (fields.size() < 2 || fields.size() > 3) return std::nullopt;
  if (fields.size() == 3 && !ParseNumber(Trimmed(fields[2]))) return std::nullopt;
  return WithUnit(ParseNumber(Trimmed(fields[0])), fields[1]);
}

std::optional<DepthReading> DecodeDepthSentence(const NmeaSentence& s) {
  if (s.type == "DBS") {
    const auto depth_m = DecodeDbs(s);
    return depth_m ? std::optional(DepthReading{Kind::kDepthM, *depth_m}) : std::nullopt;
  }
  if (s.type == "PIPS") return WithUnit(s.Number(0), s.Text(1));
  if (s.type == "PRVAT") return WithUnit(s.Number(2), s.Text(3));
  if (s.type == "PVIPS2") {
    if (const auto depth = WithUnit(s.Number(4), s.Text(5))) return depth;
    if (s.Text(3) == "d" && s.Number(2)) return DepthReading{Kind::kPressureDbar, *s.Number(2)};
  }
  return std::nullopt;
}

}  // namespace seastitch
