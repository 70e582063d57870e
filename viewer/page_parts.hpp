#pragma once

#include <string>
#include <vector>

// What report.html and the page of seastitch-page have in common.
namespace seastitch {

// A script or a style sheet that stands in a page, and its SHA-256 in hexadecimal digits.
struct PagePart {
  const char* text;
  const char* sha256;
};
PagePart PageStyle();
// Draws the map in the section of ViewerSection().
PagePart ViewerScript();
const char* ViewerSection();

// Content-Security-Policy of a page that runs these scripts, has this style and loads nothing, but
// for what `sources` allows, such as "img-src 'self'".
std::string ContentPolicy(const std::vector<PagePart>& scripts,
                          const PagePart& style,
                          const std::string& sources);

}  // namespace seastitch
