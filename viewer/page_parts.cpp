#include "viewer/page_parts.hpp"

#include <string_view>

#include "viewer/packing.hpp"
#include "viewer/viewer_parts.hpp"

namespace seastitch {
namespace {

int Digit(char c) { return c <= '9' ? c - '0' : c - 'a' + 10; }

// As a policy names a part: 'sha256-...'.
std::string Named(const PagePart& part) {
  const std::string_view hex = part.sha256;
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(16 * Digit(hex[i]) + Digit(hex[i + 1]));
  return "'sha256-" + Base64(bytes) + "'";
}

}  // namespace

PagePart PageStyle() { return {kStyle, kStyleSha256}; }
PagePart ViewerScript() { return {kViewerScript, kViewerScriptSha256}; }
const char* ViewerSection() { return kViewerSection; }

std::string ContentPolicy(const std::vector<PagePart>& scripts,
                          const PagePart& style,
                          const std::string& sources) {
  std::string policy = "default-src 'none'; base-uri 'none'; form-action 'none'; style-src " +
                       Named(style) + "; script-src";
  for (const PagePart& script : scripts) policy += ' ' + Named(script);
  return policy + "; " + sources;
}

}  // namespace seastitch
