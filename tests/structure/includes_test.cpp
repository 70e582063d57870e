// docs/design.md, section 2: which folder may know which. Holds it against every #include.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>> kMayInclude{
    {"common/core", {"common/core"}},
    {"common/convert", {"common/core", "common/convert", "seastitch"}},
    {"common/geo", {"common/core", "common/geo"}},
    {"common/parameters", {"common/core", "common/parameters"}},
    {"common/storage", {"common/core", "common/storage"}},
    {"common/runtime", {"common/core", "common/parameters", "common/runtime", "seastitch"}},
    {"codecs", {"common/core", "codecs"}},
    {"drivers", {"common", "codecs", "drivers", "seastitch"}},
    {"mapper", {"common", "mapper", "seastitch"}},
    {"optimizer", {"common", "optimizer", "seastitch"}},
    {"logger", {"common", "logger", "seastitch"}},
    {"viewer", {"common/core", "viewer"}},
    {"products", {"common", "products", "seastitch", "viewer"}},
    {"page", {"common", "page", "seastitch", "viewer"}},
    {"bench", {"common", "bench", "codecs", "drivers", "seastitch"}},
    {"survey",
     {"common", "bench", "codecs", "drivers", "mapper", "optimizer", "products", "survey"}},
    {"survey/line",
     {"common/core",
      "common/geo",
      "common/parameters",
      "common/runtime/config",
      "codecs",
      "products/files",
      "products/geo",
      "survey"}},
    {"survey/session", {"common", "mapper", "optimizer", "products", "survey/session"}},
};

// What the rooms of a folder may know of the rest of that folder, besides themselves.
const std::map<std::string, std::set<std::string>> kRooms{
    {"codecs/kongsberg", {"codecs", "codecs/navigation"}},
    {"codecs/lines", {"codecs"}},
    {"codecs/makers", {"codecs"}},
    {"codecs/navigation", {"codecs", "codecs/lines"}},
    {"mapper/calibration", {"mapper/geometry"}},
    {"mapper/geometry", {}},
    {"mapper/health", {"mapper/input", "mapper/navigation", "mapper/submaps"}},
    {"mapper/input", {"mapper/geometry", "mapper/noise"}},
    {"mapper/loops", {"mapper/noise", "mapper/registration", "mapper/submaps"}},
    {"mapper/navigation/aiding", {"mapper/navigation", "mapper/navigation/filter"}},
    {"mapper/navigation/filter", {"mapper/navigation", "mapper/navigation/aiding"}},
    {"mapper/navigation/ins", {"mapper/navigation"}},
    {"mapper/noise", {"mapper/geometry"}},
    {"mapper/registration", {"mapper/noise"}},
    {"mapper/restart", {"mapper/loops", "mapper/submaps"}},
    {"mapper/submaps", {"mapper/geometry"}},
    {"optimizer/solver", {"optimizer"}},
    {"products/files", {"products", "products/geo", "products/map", "products/track"}},
    {"products/geo", {}},
    {"products/map", {"products", "products/geo"}},
    {"products/report",
     {"products", "products/files", "products/geo", "products/map", "products/track"}},
    {"products/track", {"products", "products/files", "products/geo", "products/map"}},
    {"survey/line", {"survey"}},
    {"survey/read", {"survey", "survey/line"}},
    {"survey/plan", {"survey", "survey/line", "survey/read"}},
    {"survey/session", {}},
    {"survey/replay", {"survey", "survey/line", "survey/plan", "survey/read", "survey/session"}},
};

// Largest number of files in a folder, and those folders that still have more.
constexpr std::size_t kMostFiles = 24;
const std::map<std::string, std::size_t> kLargeFolders{
    {"bench", 26}, {"common/core", 31}, {"drivers/socket", 25}, {"tests/fuzz", 36}};

// Largest number of lines of a file, and those files that still have more.
constexpr std::ptrdiff_t kMostLines = 500;
const std::map<std::string, std::ptrdiff_t> kLongFiles{{"bench/survey_config.cpp", 600},
                                                       {"common/core/health/conditions.hpp", 534},
                                                       {"tests/mapper/random_dive.hpp", 612}};

// Libraries that a folder may include by "library/...", docs/design.md, last column. Files of the
// kernel and of the C library are free.
const std::map<std::string, std::set<std::string>> kMayUse{
    {"common/core", {"Eigen"}},
    {"common/convert", {"Eigen"}},
    {"common/geo", {"Eigen", "GeographicLib"}},
    {"common/parameters", {"Eigen"}},
    {"common/storage", {"Eigen", "pcl"}},
    {"common/runtime", {"Eigen", "CLI", "lcm", "nlohmann", "spdlog", "systemd", "yaml-cpp"}},
    {"codecs", {"Eigen"}},
    {"drivers", {"Eigen", "spdlog"}},
    {"mapper", {"Eigen", "GeographicLib", "boost", "nlohmann", "pcl", "spdlog"}},
    {"optimizer", {"Eigen", "boost", "ceres"}},
    {"logger", {"spdlog"}},
    {"viewer", {"Eigen", "nlohmann"}},
    {"products", {"Eigen", "GeographicLib", "boost", "nlohmann"}},
    {"page", {"Eigen", "nlohmann", "spdlog"}},
    {"survey", {"Eigen", "nlohmann"}},
    {"bench", {"Eigen", "GeographicLib"}},
};
const std::set<std::string> kOfTheSystem{"arpa", "linux", "net", "netinet", "sys"};

// Everything in these is pure (no messages, no process shell, no files, no clock, no thread) but
// for the shells, which are known by their names.
const std::vector<std::string> kPure{
    "common/core", "common/parameters", "codecs", "drivers", "mapper", "optimizer", "viewer"};
const std::regex kShell(
    ".*_(node|main|config|driver|starts|store|watch)\\.[ch]pp|mapper/mapper_parameters\\.cpp|"
    "mapper/graph_publisher\\.[ch]pp|mapper/restart/map_writer\\.[ch]pp|"
    "drivers/socket/.*");

// The doors of libraries from outside: every include of such a header stands in a file like this.
const std::vector<std::pair<std::string, std::regex>> kDoors{
    {"pcl/", std::regex("common/storage/submap_file\\.cpp|mapper/registration/gicp\\.cpp")},
    {"gdal", std::regex("products/geo/gdal_use\\.[ch]pp|bench/terrain_raster\\.cpp")},
    {"ogr", std::regex("products/geo/[^/]*\\.cpp|bench/terrain_raster\\.cpp")},
    {"cairo", std::regex("products/report/picture\\.cpp")},
    {"fftw3", std::regex("mapper/registration/correlator\\.cpp")},
    {"lcm/", std::regex("common/runtime/bus\\.hpp|examples/listen\\.cpp")},
    {"glib", std::regex("common/runtime/bus\\.cpp")},
    // The simulator keeps a map frame of its own: it is what ours is held against.
    {"GeographicLib/",
     std::regex("common/geo/map_frame\\.cpp|products/geo/map_projection\\.cpp|mapper/navigation/"
                "filter/strapdown\\.cpp|"
                "bench/sensor_models\\.cpp")},
    {"systemd/", std::regex("common/runtime/.*\\.cpp")},
    {"httplib", std::regex("page/page_server\\.cpp")},
    {"zlib", std::regex("common/storage/crc32\\.cpp|viewer/packing\\.cpp")},
    {"yaml-cpp/", std::regex("common/runtime/config/config\\.hpp")},
    {"ceres/", std::regex("optimizer/solver/ceres_minimiser\\.cpp")},
};

// The folders of the programs' sources.
const std::vector<std::string> kProgramFolders{"common",
                                               "codecs",
                                               "drivers",
                                               "mapper",
                                               "optimizer",
                                               "logger",
                                               "viewer",
                                               "products",
                                               "page",
                                               "bench",
                                               "survey",
                                               "tools",
                                               "examples"};

bool IsUnder(const std::string& path, const std::string& folder) {
  return path.rfind(folder + "/", 0) == 0;
}

std::vector<fs::path> Sources(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".hpp" || entry.path().extension() == ".cpp") {
      files.push_back(entry.path());
    }
  }
  return files;
}

std::vector<std::string> Matches(const fs::path& file, const std::regex& pattern) {
  std::vector<std::string> found;
  std::ifstream in(file);
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_search(line, match, pattern)) found.push_back(match[1]);
  }
  return found;
}

std::vector<std::string> ProjectIncludes(const fs::path& file) {
  static const std::regex include(R"re(^\s*#include "([^"]+)")re");
  return Matches(file, include);
}

std::vector<std::string> SystemIncludes(const fs::path& file) {
  static const std::regex include(R"re(^\s*#include <([^>]+)>)re");
  return Matches(file, include);
}

std::vector<std::string> ClocksAndThreads(const fs::path& file) {
  static const std::regex use(
      R"re((::now\(\)|clock_gettime|gettimeofday|std::j?thread|<thread>|<ctime>))re");
  return Matches(file, use);
}

TEST(Includes, StayWithinWhatEachFolderMayKnow) {
  const fs::path root = SourceDir();
  for (const auto& [folder, allowed] : kMayInclude) {
    const std::vector<fs::path> files = Sources(root / folder);
    EXPECT_FALSE(files.empty()) << folder;
    for (const fs::path& file : files) {
      for (const std::string& include : ProjectIncludes(file)) {
        const bool ok = std::any_of(allowed.begin(), allowed.end(), [&](const std::string& a) {
          return IsUnder(include, a);
        });
        EXPECT_TRUE(ok) << fs::relative(file, root) << " includes " << include;
      }
    }
  }
}

TEST(Includes, RoomsOfAFolderKnowWhatTheyMay) {
  const fs::path root = SourceDir();
  for (const auto& [room, allowed] : kRooms) {
    const std::string folder = room.substr(0, room.find('/'));
    const std::vector<fs::path> files = Sources(root / room);
    EXPECT_FALSE(files.empty()) << room;
    for (const fs::path& file : files) {
      for (const std::string& include : ProjectIncludes(file)) {
        const std::string from = fs::path(include).parent_path().string();
        EXPECT_TRUE(!IsUnder(include, folder) || from == room || allowed.contains(from))
            << fs::relative(file, root) << " includes " << include;
      }
    }
  }
}

TEST(Folders, HaveSoManyFilesThatOneFindsThem) {
  const fs::path root = SourceDir();
  std::vector<std::string> tops = kProgramFolders;
  tops.emplace_back("tests");
  for (const std::string& top : tops) {
    std::map<std::string, std::size_t> files;
    for (const fs::path& file : Sources(root / top))
      ++files[fs::relative(file.parent_path(), root).string()];
    for (const auto& [folder, number] : files) {
      const auto large = kLargeFolders.find(folder);
      EXPECT_LE(number, large == kLargeFolders.end() ? kMostFiles : large->second) << folder;
    }
  }
}

TEST(Files, AreShortEnoughToBeRead) {
  const fs::path root = SourceDir();
  std::vector<std::string> tops = kProgramFolders;
  tops.emplace_back("tests");
  for (const std::string& top : tops) {
    for (const fs::path& file : Sources(root / top)) {
      const std::string name = fs::relative(file, root).string();
      std::ifstream in(file);
      const auto allowed = kLongFiles.find(name);
      EXPECT_LE(std::count(std::istreambuf_iterator<char>(in), {}, '\n'),
                allowed == kLongFiles.end() ? kMostLines : allowed->second)
          << name;
    }
  }
}

TEST(Includes, PurePartsKnowNoMessageNoProcessAndNoClock) {
  const fs::path root = SourceDir();
  int pure = 0;
  for (const std::string& folder : kPure) {
    for (const fs::path& file : Sources(root / folder)) {
      const std::string name = fs::relative(file, root).string();
      if (std::regex_match(name, kShell)) continue;
      ++pure;
      for (const std::string& include : ProjectIncludes(file)) {
        EXPECT_FALSE(IsUnder(include, "common/runtime") || IsUnder(include, "common/storage") ||
                     IsUnder(include, "seastitch"))
            << name << " includes " << include;
      }
      for (const std::string& use : ClocksAndThreads(file)) ADD_FAILURE() << name << ": " << use;
    }
  }
  EXPECT_GT(pure, 100);
}

// Buses join processes, functions join classes: only tests open a bus inside one process. An engine
// that joins mapper and optimizer by calls knows no node, no bus and no message.
TEST(Includes, NoBusJoinsClasses) {
  const fs::path root = SourceDir();
  static const std::regex in_process(R"re(("memq://))re");
  static const std::regex of_a_process(
      R"re(#include "((common/convert|common/runtime/bus|mapper/mapper_node|optimizer/optimizer_node|seastitch/)[^"]*)")re");
  int files = 0;
  for (const std::string& folder : kProgramFolders)
    for (const fs::path& file : Sources(root / folder)) {
      ++files;
      EXPECT_TRUE(Matches(file, in_process).empty()) << fs::relative(file, root);
    }
  EXPECT_GT(files, 500);
  for (const char* folder : {"survey/session", "survey/plan", "survey/line"})
    for (const fs::path& file : Sources(root / folder))
      for (const std::string& include : Matches(file, of_a_process))
        ADD_FAILURE() << fs::relative(file, root) << " includes " << include;
}

// Facts that stood in many places before, each with the file where it stands.
TEST(Facts, StandInOnePlace) {
  struct Fact {
    const char* what;
    std::regex pattern;
    std::set<std::string> places;
  };
  const std::vector<Fact> facts{
      // A decoder may not use the shell of a process.
      {"how a whole file is read",
       std::regex(R"re((istreambuf_iterator|\brdbuf\(\)))re"),
       {"common/runtime/files/whole_file.cpp", "drivers/can/dbc.cpp"}},
      // UtcText() is in common/core/time.hpp.
      {"UTC as text", std::regex(R"re(\b(gmtime_r|strftime)\b)re"), {}},
      {"the begin and the week of GPS time",
       std::regex(R"re(\b(315'964'800|604'800))re"),
       {"common/core/time.hpp"}},
      {"the radius of the earth",
       std::regex(R"re(\b(6'371'000|6\.371e6))re"),
       {"common/core/geo_point.hpp"}},
      {"how long a fault holds after an event",
       std::regex(R"re(\bk(?:Event|Refusal)s?HoldS?\w*)re"),
       {}},
      // HEALTH itself, for tests.
      {"counters are for people: no code asks for one by its name",
       std::regex(
           R"re((counters(?:\(\)|_)?\.(?:find|at|count|contains)\(|[cC]ounter\("|counter\.name(?: [!=]=|\.(?:starts_with|ends_with|find))))re"),
       {"common/runtime/health.cpp"}},
  };
  const fs::path root = SourceDir();
  for (const Fact& fact : facts)
    for (const std::string& folder : kProgramFolders)
      for (const fs::path& file : Sources(root / folder)) {
        const std::string name = fs::relative(file, root).string();
        if (fact.places.contains(name)) continue;
        for (const std::string& found : Matches(file, fact.pattern))
          ADD_FAILURE() << name << ": " << found << " (" << fact.what << ")";
      }
}

TEST(Channels, AreNamedInOnePlace) {
  const fs::path root = SourceDir();
  static const std::regex constant(R"re(constexpr char k\w+\[\] = ("\w+");)re");
  const std::vector<std::string> names = Matches(root / "common/core/channel_names.hpp", constant);
  EXPECT_GT(names.size(), 20u);
  for (const std::string& folder : kProgramFolders) {
    for (const fs::path& file : Sources(root / folder)) {
      const std::string name = fs::relative(file, root).string();
      // The second shows the bus to programs that have none of our headers but the messages.
      if (name == "common/core/channel_names.hpp" || name == "examples/listen.cpp") continue;
      std::ifstream in(file);
      for (std::string line; std::getline(in, line);)
        for (const std::string& channel : names)
          EXPECT_EQ(line.find(channel), std::string::npos) << name << ": " << line;
    }
  }
}

TEST(Includes, LibrariesAreThoseThatTheFolderMayUse) {
  const fs::path root = SourceDir();
  for (const auto& [folder, allowed] : kMayUse) {
    for (const fs::path& file : Sources(root / folder)) {
      for (const std::string& include : SystemIncludes(file)) {
        const std::string library = include.substr(0, include.find('/'));
        const bool ok =
            library == include || kOfTheSystem.contains(library) || allowed.contains(library);
        EXPECT_TRUE(ok) << fs::relative(file, root) << " includes " << include;
      }
    }
  }
}

TEST(Includes, LibrariesFromOutsideStayBehindTheirDoors) {
  const fs::path root = SourceDir();
  for (const std::string& folder : kProgramFolders) {
    for (const fs::path& file : Sources(root / folder)) {
      const std::string name = fs::relative(file, root).string();
      for (const std::string& include : SystemIncludes(file)) {
        for (const auto& [library, door] : kDoors) {
          EXPECT_TRUE(include.rfind(library, 0) != 0 || std::regex_match(name, door))
              << name << " includes " << include;
        }
      }
    }
  }
}

bool UsesSpdlog(const fs::path& file) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("#include <spdlog/")) return true;
  return false;
}

// A target that does not link spdlog compiles all of it into each file, with a logger of its own.
TEST(Includes, SpdlogIsLinkedWhereItIsUsed) {
  std::ifstream commands(BuildDir() / "compile_commands.json");
  if (!commands) GTEST_SKIP() << "this tree was not configured with a preset";
  static const std::regex source(R"re(^\s*"file": "([^"]+)")re");
  std::string command;
  int files = 0;
  for (std::string line; std::getline(commands, line);) {
    std::smatch file;
    if (line.find("\"command\": ") != std::string::npos)
      command = line;
    else if (std::regex_search(line, file, source) && UsesSpdlog(file[1].str())) {
      ++files;
      EXPECT_NE(command.find("-DSPDLOG_COMPILED_LIB"), std::string::npos) << file[1];
    }
  }
  EXPECT_GT(files, 10);
}

}  // namespace
}  // namespace seastitch
