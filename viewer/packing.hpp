#pragma once

#include <string>

namespace seastitch {

// Bytes compressed as zlib has them (RFC 1950). Throws std::runtime_error where memory is short.
std::string Deflated(const std::string& bytes);

// Bytes as text (RFC 4648, section 4).
std::string Base64(const std::string& bytes);

}  // namespace seastitch
