#include "common/runtime/files/unfinished_files.hpp"

#include <gtest/gtest.h>
#include <signal.h>

#include <csignal>
#include <filesystem>
#include <stdexcept>

#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

TEST(UnfinishedFiles, AreDeletedUnlessTheyAreKept) {
  const TemporaryDir dir;
  const fs::path half = dir.path() / "half", whole = dir.path() / "whole";
  const fs::path old = dir.Write("old", "somebody's");
  try {
    UnfinishedFiles unfinished({half, old});
    dir.Write("half", "begun");
    throw std::runtime_error("disk full");
  } catch (const std::runtime_error&) {
  }
  EXPECT_FALSE(fs::exists(half));
  EXPECT_TRUE(fs::exists(old)) << "it was there before";
  {
    UnfinishedFiles unfinished({whole});
    dir.Write("whole", "done");
    unfinished.Keep();
  }
  EXPECT_TRUE(fs::exists(whole));
}

TEST(UnfinishedFiles, AreDeletedAtASignalWhichThenEndsTheProcess) {
  const TemporaryDir dir;
  for (const int signal : {SIGINT, SIGTERM}) {
    EXPECT_EXIT(
        {
          sigset_t none;
          sigemptyset(&none);
          sigprocmask(SIG_SETMASK, &none, nullptr);  // an event loop of another test blocks signals
          UnfinishedFiles unfinished({dir.path() / "half"});
          dir.Write("half", "begun");
          std::raise(signal);
        },
        testing::KilledBySignal(signal),
        "");
    EXPECT_FALSE(fs::exists(dir.path() / "half"));
  }
}

}  // namespace
}  // namespace seastitch
