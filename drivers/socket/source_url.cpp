#include "drivers/socket/source_url.hpp"

#include <sstream>
#include <stdexcept>

namespace seastitch {

SourceUrl ParseSourceUrl(const std::string& text, const std::set<std::string>& allowed_options) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos)
    throw std::runtime_error(text + ": expected can:INTERFACE, candump:FILE or udp:HOST:PORT");
  const std::size_t mark = text.find('?', colon);
  SourceUrl url;
  url.text = text;
  url.scheme = text.substr(0, colon);
  url.address = text.substr(colon + 1, mark == std::string::npos ? mark : mark - colon - 1);
  if (mark == std::string::npos) return url;
  std::istringstream options(text.substr(mark + 1));
  for (std::string option; std::getline(options, option, '&');) {
    const std::size_t equals = option.find('=');
    const std::string key = option.substr(0, equals);
    if (equals == std::string::npos || !allowed_options.contains(key))
      throw std::runtime_error(text + ": unknown option '" + option + "'");
    url.options[key] = option.substr(equals + 1);
  }
  return url;
}

}  // namespace seastitch
