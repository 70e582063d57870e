#include "common/runtime/stage.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "common/runtime/for_each_beside.hpp"
#include "common/runtime/jobs_beside.hpp"

namespace seastitch {
namespace {

TEST(Stage, TakesEverythingInItsOrder) {
  std::vector<int> taken;
  std::atomic<int> in_the_queue = 0;
  {
    Stage<int> stage(
        [&](int i) {
          --in_the_queue;
          taken.push_back(i);
        },
        3);
    for (int i = 0; i < 1000; ++i) {
      stage.Add(i);
      EXPECT_LE(++in_the_queue, 5) << "three wait, one is taken, one was added";
    }
    stage.Finish();
    EXPECT_EQ(taken.size(), 1000u);
    stage.Add(1000);
  }
  ASSERT_EQ(taken.size(), 1001u) << "the destructor takes what waits";
  for (int i = 0; i <= 1000; ++i) EXPECT_EQ(taken[static_cast<std::size_t>(i)], i);
}

TEST(Stage, ThrowsWhatATakeThrewAndNeverHangs) {
  Stage<int> stage(
      [](int i) {
        if (i == 1) throw std::runtime_error("full");
      },
      1);
  stage.Add(0);
  stage.Add(1);
  EXPECT_THROW(
      {
        for (int i = 2; i < 10; ++i) stage.Add(i);
        stage.Finish();
      },
      std::runtime_error);
  EXPECT_THROW(stage.Finish(), std::runtime_error);
}

TEST(JobsBeside, RunsEachInItsOrderBeforeItHasFinished) {
  std::vector<int> ran;
  JobsBeside jobs;
  jobs.Finish();
  for (int i = 0; i < 1000; ++i) {
    jobs.Add([&ran, i] { ran.push_back(i); });
    if (i % 77 != 0) continue;
    jobs.Finish();
    ASSERT_EQ(ran.size(), static_cast<std::size_t>(i) + 1);
  }
  jobs.Finish();
  ASSERT_EQ(ran.size(), 1000u);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(ran[static_cast<std::size_t>(i)], i);
}

TEST(JobsBeside, ThrowsWhatAJobThrewAndNeverHangs) {
  JobsBeside jobs;
  jobs.Add([] { throw std::runtime_error("full"); });
  EXPECT_THROW(
      {
        for (int i = 0; i < 1000; ++i) jobs.Add([] {});
        jobs.Finish();
      },
      std::runtime_error);
}

TEST(JobsBeside, RunAfterThoseOfTheQueueBefore) {
  constexpr std::size_t kJobs = 5000;
  std::vector<int> made(kJobs), taken(kJobs);
  std::size_t last = 0;
  JobsBeside making;
  JobsBeside taking(&making);
  for (std::size_t i = 0; i < kJobs; ++i) {
    making.Add([&made, i] { made[i] = 1; });
    if (i % 3 != 0) continue;  // not as many here as there
    taking.Add([&, i] {
      taken[i] = made[i];
      last = i;
    });
    if (i % 501 != 0) continue;
    taking.Finish();
    ASSERT_EQ(last, i);
  }
  taking.Finish();
  for (std::size_t i = 0; i < kJobs; ++i) {
    EXPECT_EQ(made[i], 1) << i;
    EXPECT_EQ(taken[i], i % 3 == 0 ? 1 : 0) << i;
  }
}

TEST(JobsBeside, NeverHangWhereAJobOfTheQueueBeforeThrew) {
  JobsBeside making;
  JobsBeside taking(&making);
  EXPECT_THROW(
      {
        for (int i = 0; i < 1000; ++i) {
          making.Add([i] {
            if (i == 100) throw std::runtime_error("full");
          });
          taking.Add([] {});
        }
        taking.Finish();
      },
      std::runtime_error);
}

TEST(ForEachBeside, CallsEachOnce) {
  for (const std::size_t n : {0u, 1u, 2u, 1000u}) {
    std::vector<std::atomic<int>> calls(n);
    ForEachBeside(n, [&](std::size_t i) { ++calls[i]; });
    for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1);
  }
}

TEST(ForEachBeside, ThrowsAfterAllHaveEnded) {
  std::atomic<int> calls = 0;
  EXPECT_THROW(ForEachBeside(50,
                             [&](std::size_t i) {
                               ++calls;
                               if (i == 7) throw std::runtime_error("7");
                             }),
               std::runtime_error);
  EXPECT_EQ(calls, 50);
}

}  // namespace
}  // namespace seastitch
