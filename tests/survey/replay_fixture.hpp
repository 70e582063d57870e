#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/imu_t.hpp"
#include "survey/replay/replay.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

// The command `seastitch replay` on a small recorded survey.
namespace seastitch {

namespace fs = std::filesystem;

inline std::string Seastitch(const std::string& arguments) {
  return Program("seastitch") + " " + arguments;
}

// One line, to whom it came, and an exit code that says so.
inline void ExpectOneClearLine(const CommandResult& result, const std::string& must_say) {
  EXPECT_NE(result.exit_code, 0) << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  EXPECT_NE(result.output.find(must_say), std::string::npos) << result.output;
}

class Replay : public ::testing::Test {
 protected:
  // The log of a short survey, made once.
  static const fs::path& ShortLog() {
    static const TemporaryDir dir;
    static const fs::path log = [] {
      fs::path path = dir.path() / "short.lcmlog";
      const CommandResult made =
          RunCommand(Seastitch("bench --survey " + ConfigFile("bench/short.yaml") + " --log ") +
                     path.string());
      EXPECT_EQ(made.exit_code, 0) << made.output;
      return path;
    }();
    return log;
  }

  CommandResult ReplayOf(const fs::path& input, const std::string& more = "") {
    return RunCommand(Seastitch("replay " + input.string() + " --quiet --out " +
                                (dir_.path() / "out").string() + " " + more));
  }
  fs::path Out(const std::string& file) const { return dir_.path() / "out" / file; }

  TemporaryDir dir_;
};

// The short log with the fingerprint of every n-th event of a channel damaged.
inline void CopyWithForeign(const fs::path& from,
                            const fs::path& to,
                            const std::string& channel,
                            int n) {
  EventLogReader all(from);
  EventLogWriter some(to);
  int seen = 0;
  while (std::optional<LogEvent> event = all.Next()) {
    if (event->channel == channel && seen++ % n == 0) event->data[0] ^= 0x55;
    some.Write(event->utime, event->channel, event->data.data(), event->data.size());
  }
  some.Flush();
}

}  // namespace seastitch
