#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/runtime/config/config.hpp"
#include "logger/config_archive.hpp"
#include "logger/foreign_channels.hpp"
#include "logger/gap_counter.hpp"
#include "logger/housekeeper.hpp"
#include "logger/log_series.hpp"
#include "logger/log_writer.hpp"
#include "logger/logger_config.hpp"
#include "logger/logger_node.hpp"
#include "seastitch/counter_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/nav_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "seastitch/submap_t.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

// Events, folders and limits, for the tests of the logger.
namespace seastitch {

using testing::EndsWith;
using testing::HasSubstr;
using testing::ThrowsMessage;

inline LogEvent Event(std::int64_t utime, std::size_t size) {
  return {utime, "C", std::vector<std::uint8_t>(size, 7)};
}

}  // namespace seastitch
