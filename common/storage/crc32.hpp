#pragma once

#include <boost/crc.hpp>
#include <cstdint>

#include "common/core/bytes.hpp"

namespace seastitch {

// CRC-32 (ISO 3309, as in zip), by which our files know that they were damaged.
inline std::uint32_t Crc32(Bytes bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

}  // namespace seastitch
