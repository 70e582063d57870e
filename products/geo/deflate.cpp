#include "products/geo/deflate.hpp"

#include <cpl_conv.h>

#include <memory>

#include "products/geo/gdal_use.hpp"

namespace seastitch {

std::string Deflated(const std::string& bytes) {
  constexpr int kSmallest = 9;
  std::size_t size = 0;
  const std::unique_ptr<void, decltype(&VSIFree)> packed(
      CPLZLibDeflate(bytes.data(), bytes.size(), kSmallest, nullptr, 0, &size), &VSIFree);
  Require(packed != nullptr, "cannot compress");
  return {static_cast<const char*>(packed.get()), size};
}

}  // namespace seastitch
