#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace seastitch {

#define SKIP_WITHOUT(path)                  \
  if (!std::filesystem::exists(path)) {     \
    GTEST_SKIP() << path << " is not here"; \
  }

inline nlohmann::json ReadJson(const std::filesystem::path& path) {
  return nlohmann::json::parse(std::ifstream(path));
}

inline std::vector<std::uint8_t> FromHex(const std::string& hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

}  // namespace seastitch
