#include "common/runtime/files/folder_lock.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

std::string ReasonOfRefusal(const std::filesystem::path& folder) {
  try {
    const FolderLock lock(folder);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(FolderLock, NamesWhoHoldsIt) {
  const TemporaryDir dir;
  {
    const FolderLock lock(dir.path());
    EXPECT_EQ(
        ReasonOfRefusal(dir.path()),
        dir.path().string() + ": in use by process " + std::to_string(getpid()) + "; end it first");
  }
  EXPECT_EQ(ReasonOfRefusal(dir.path()), "");
}

TEST(FolderLock, EndsWithAProcessThatIsKilled) {
  const TemporaryDir dir;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(dir.path());
    if (write(ready[1], "x", 1) == 1) pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(
      ReasonOfRefusal(dir.path()),
      dir.path().string() + ": in use by process " + std::to_string(child) + "; end it first");
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_EQ(ReasonOfRefusal(dir.path()), "");
  close(ready[0]);
  close(ready[1]);
}

// Of a process that was killed before it had written the whole, or of another boot.
TEST(FolderLock, TakesAFileThatNobodyHolds) {
  const TemporaryDir dir;
  for (const char* left : {"", "{\"pid\": 1, \"boot_id\": \"of another day\"}\n", "{\"pi"}) {
    dir.Write("lock", left);
    EXPECT_EQ(ReasonOfRefusal(dir.path()), "");
  }
}

TEST(FolderLock, SaysWhyItCannotBe) {
  const TemporaryDir dir;
  EXPECT_EQ(ReasonOfRefusal(dir / "none"),
            (dir / "none").string() + ": lock cannot be opened: No such file or directory");
}

}  // namespace
}  // namespace seastitch
