#pragma once

#include <cstdint>

#include "common/core/bytes.hpp"

namespace seastitch {

// CRC-32 (ISO 3309, as in zip), by which our files know that they were damaged.
std::uint32_t Crc32(Bytes bytes);

}  // namespace seastitch
