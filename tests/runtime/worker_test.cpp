#include "common/runtime/worker.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

#include "common/runtime/event_loop.hpp"

namespace seastitch {
namespace {

TEST(ThreadWorker, RunsJobsBesideAndQuickPartsOnTheCallersThreadInOrder) {
  ThreadWorker worker(1000);
  const std::thread::id caller = std::this_thread::get_id();
  std::vector<int> done;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(worker.Post([i, caller, &done]() -> std::function<void()> {
      EXPECT_NE(std::this_thread::get_id(), caller);
      return [i, caller, &done] {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        done.push_back(i);
      };
    }));
  }
  worker.Finish();
  std::vector<int> expected(1000);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(done, expected);
  EXPECT_EQ(worker.queue_depth(), 0u);
}

TEST(ThreadWorker, RefusesWhenTheQueueIsFull) {
  ThreadWorker worker(2);
  std::promise<void> started;
  std::promise<void> go_on;
  worker.Post([&]() -> std::function<void()> {
    started.set_value();
    go_on.get_future().wait();
    return nullptr;  // no quick part
  });
  started.get_future().wait();
  const Worker::Job nothing = [] { return [] {}; };
  EXPECT_TRUE(worker.Post(nothing));
  EXPECT_TRUE(worker.Post(nothing));
  EXPECT_FALSE(worker.Post(nothing));
  EXPECT_EQ(worker.queue_depth(), 3u);  // one runs, two wait
  go_on.set_value();
  worker.Finish();
}

TEST(ThreadWorker, FinishesWhatQuickPartsPostAgain) {
  ThreadWorker worker(10);
  int rounds = 0;
  std::function<std::function<void()>()> job = [&] {
    return [&] {
      if (++rounds < 50) worker.Post(job);
    };
  };
  worker.Post(job);
  worker.Finish();
  EXPECT_EQ(rounds, 50);
}

TEST(ThreadWorker, WakesTheLoop) {
  EventLoop loop;
  ThreadWorker worker(10);
  loop.Add(worker.fd(), [&] { worker.Drain(); });
  worker.Post([&] { return [&] { loop.Stop(); }; });
  EXPECT_EQ(loop.Run(), 0);
}

TEST(ThreadWorker, BringsAnExceptionToTheCaller) {
  ThreadWorker worker(10);
  worker.Post([]() -> std::function<void()> { throw std::runtime_error("singular"); });
  EXPECT_THROW(worker.Finish(), std::runtime_error);
}

TEST(ThreadWorker, DropsWhatWaitsWhenItEnds) {
  std::atomic<int> ran = 0;
  std::promise<void> started;
  {
    ThreadWorker worker(100);
    worker.Post([&]() -> std::function<void()> {
      ++ran;
      started.set_value();
      std::this_thread::yield();
      return [&] { ADD_FAILURE() << "nobody drains"; };
    });
    started.get_future().wait();
  }
  EXPECT_EQ(ran, 1);
}

TEST(InlineWorker, IsDoneWhenPostReturns) {
  InlineWorker worker;
  bool done = false;
  EXPECT_TRUE(worker.Post([&] { return [&] { done = true; }; }));
  EXPECT_TRUE(done);
}

}  // namespace
}  // namespace seastitch
