#include "common/runtime/event_loop.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <vector>

namespace seastitch {
namespace {

class Pipe {
 public:
  Pipe() {
    if (pipe(fds_.data()) != 0) std::abort();
  }
  ~Pipe() {
    close(fds_[0]);
    close(fds_[1]);
  }
  int read_end() const { return fds_[0]; }
  void Put(char c) const { ASSERT_EQ(write(fds_[1], &c, 1), 1); }
  char Get() const {
    char c = 0;
    EXPECT_EQ(read(fds_[0], &c, 1), 1);
    return c;
  }

 private:
  std::array<int, 2> fds_{};
};

TEST(EventLoop, StopsOnSigtermAndOnSigint) {
  for (const int signal : {SIGTERM, SIGINT}) {
    EventLoop loop;
    ASSERT_EQ(raise(signal), 0);
    EXPECT_EQ(loop.Run(), EXIT_SUCCESS);
  }
}

TEST(EventLoop, CallsTheHandlerOfWhatIsReady) {
  EventLoop loop;
  const Pipe quiet;
  const Pipe busy;
  loop.Add(quiet.read_end(), [&] { ADD_FAILURE() << "nothing came"; });
  loop.Add(busy.read_end(), [&] {
    if (busy.Get() == 'q') loop.Stop();
  });
  busy.Put('a');
  busy.Put('q');
  EXPECT_EQ(loop.Run(), EXIT_SUCCESS);
}

TEST(EventLoop, LetsAHandlerRemoveItselfAndOthersAndAddNew) {
  EventLoop loop;
  const Pipe first;
  const Pipe second;
  const Pipe third;
  int first_calls = 0;
  int second_calls = 0;
  for (const Pipe* p : {&first, &second}) p->Put('x');
  loop.Add(first.read_end(), [&] {
    ++first_calls;
    loop.Remove(first.read_end());
    loop.Remove(second.read_end());
    loop.Add(third.read_end(), [&] { loop.Stop(); });
    third.Put('x');
  });
  loop.Add(second.read_end(), [&] { ++second_calls; });
  EXPECT_EQ(loop.Run(), EXIT_SUCCESS);
  EXPECT_EQ(first_calls, 1);
  EXPECT_EQ(second_calls, 0) << "it was ready, but removed before its turn";
}

TEST(EventLoop, KnowsAReopenedDescriptorFromTheRemovedOne) {
  EventLoop loop;
  const Pipe pipe;
  pipe.Put('x');
  int old_calls = 0;
  loop.Add(pipe.read_end(), [&] { ++old_calls; });
  loop.Remove(pipe.read_end());
  loop.Add(pipe.read_end(), [&] { loop.Stop(); });  // the number is reused after a reconnect
  EXPECT_EQ(loop.Run(), EXIT_SUCCESS);
  EXPECT_EQ(old_calls, 0);
}

TEST(EventLoop, DropsADescriptorThatWasClosedWithoutRemove) {
  EventLoop loop;
  loop.Every(std::chrono::milliseconds(5), [&] { loop.Stop(); });
  const int closed = dup(STDERR_FILENO);
  loop.Add(closed, [] { ADD_FAILURE(); });
  close(closed);
  EXPECT_EQ(loop.Run(), EXIT_SUCCESS);
}

TEST(EventLoop, RepeatsEveryPeriod) {
  EventLoop loop;
  int ticks = 0;
  loop.Every(std::chrono::milliseconds(1), [&] {
    if (++ticks == 5) loop.Stop();
  });
  EXPECT_EQ(loop.Run(), EXIT_SUCCESS);
  EXPECT_EQ(ticks, 5);
}

TEST(EventLoop, SurvivesWritingToAPeerThatWentAway) {
  EventLoop loop;
  int fds[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
  close(fds[1]);
  EXPECT_EQ(write(fds[0], "x", 1), -1);  // SIGPIPE would have ended the test
  close(fds[0]);
}

}  // namespace
}  // namespace seastitch
