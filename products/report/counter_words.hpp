#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

namespace seastitch {

// Name of a counter as people read it, in the output of commands and in the report: words in place
// of underscores, without the prefix that says which part of the program counts, abbreviations in
// capitals. "survey_pings_without_position" becomes "pings without position".
inline std::string CounterInWords(std::string_view name) {
  for (const std::string_view part : {"survey_", "nav_"})
    if (name.starts_with(part)) name.remove_prefix(part.size());
  constexpr std::array kAbbreviations{"can",
                                      "crc",
                                      "crs",
                                      "dvl",
                                      "gps",
                                      "gsf",
                                      "imu",
                                      "ins",
                                      "las",
                                      "mbes",
                                      "nmea",
                                      "svp",
                                      "udp",
                                      "utc",
                                      "xtf",
                                      "xyz"};
  std::string words;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('_', begin), name.size());
    std::string word(name.substr(begin, end - begin));
    if (std::find(kAbbreviations.begin(), kAbbreviations.end(), word) != kAbbreviations.end())
      std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) {
        return static_cast<char>(std::toupper(c));
      });
    if (!words.empty() && !word.empty()) words += ' ';
    words += word;
    begin = end + 1;
  }
  return words;
}

}  // namespace seastitch
