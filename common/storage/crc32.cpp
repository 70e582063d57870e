#include "common/storage/crc32.hpp"

#include <zlib.h>

namespace seastitch {

std::uint32_t Crc32(Bytes bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, bytes.data(), bytes.size()));
}

}  // namespace seastitch
