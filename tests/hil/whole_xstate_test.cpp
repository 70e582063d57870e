#include "tests/hil/whole_xstate.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <vector>

namespace seastitch {
namespace {

using Bytes = std::vector<unsigned char>;

void* const kXstate = reinterpret_cast<void*>(NT_X86_XSTATE);

long RealPtrace(__ptrace_request request, pid_t pid, void* address, void* data) {
  return ptrace(request, pid, address, data);
}

// A processor's area as Linux gives it to a tracer: read in part, written only whole.
struct FakeKernel {
  static inline Bytes area;
  static inline int calls = 0;
  static inline __ptrace_request last_request{};

  static void Reset(std::size_t size) {
    area.assign(size, 0xAA);
    calls = 0;
  }
  static long Ptrace(__ptrace_request request, pid_t, void*, void* data) {
    ++calls;
    last_request = request;
    if (request != PTRACE_GETREGSET && request != PTRACE_SETREGSET) return 42;
    auto* io = static_cast<iovec*>(data);
    io->iov_len = std::min(io->iov_len, area.size());
    if (request == PTRACE_GETREGSET) {
      std::memcpy(io->iov_base, area.data(), io->iov_len);
    } else if (io->iov_len < area.size()) {
      errno = EFAULT;
      return -1;
    } else {
      std::memcpy(area.data(), io->iov_base, io->iov_len);
    }
    return 0;
  }
};

long Write(Bytes* bytes) {
  iovec io{bytes->data(), bytes->size()};
  return PtraceWithWholeXstate(FakeKernel::Ptrace, PTRACE_SETREGSET, 1, kXstate, &io);
}

TEST(WholeXstate, CompletesAPartWithWhatTheProcessHas) {
  FakeKernel::Reset(11'008);
  Bytes part(2'696, 0x55);
  EXPECT_EQ(Write(&part), 0);
  Bytes expected(11'008, 0xAA);
  std::fill_n(expected.begin(), part.size(), 0x55);
  EXPECT_EQ(FakeKernel::area, expected);
}

TEST(WholeXstate, LeavesAnAreaThatFitsAsItIs) {
  FakeKernel::Reset(2'440);
  Bytes longer(2'696, 0x55);
  EXPECT_EQ(Write(&longer), 0);
  EXPECT_EQ(FakeKernel::calls, 1);
  EXPECT_EQ(FakeKernel::area, Bytes(2'440, 0x55));
}

TEST(WholeXstate, GivesUpOnAnAreaBeyondItsOwnBuffer) {
  FakeKernel::Reset(128 * 1024);
  Bytes part(2'696, 0x55);
  EXPECT_EQ(Write(&part), -1);
  EXPECT_EQ(errno, EFAULT);
  EXPECT_EQ(FakeKernel::area, Bytes(128 * 1024, 0xAA));
}

TEST(WholeXstate, HandsEveryOtherCallOnAsItCame) {
  FakeKernel::Reset(11'008);
  EXPECT_EQ(PtraceWithWholeXstate(FakeKernel::Ptrace, PTRACE_CONT, 1, nullptr, nullptr), 42);
  EXPECT_EQ(FakeKernel::last_request, PTRACE_CONT);

  Bytes registers(216);
  iovec io{registers.data(), registers.size()};
  EXPECT_EQ(PtraceWithWholeXstate(
                FakeKernel::Ptrace, PTRACE_SETREGSET, 1, reinterpret_cast<void*>(NT_PRSTATUS), &io),
            -1);
  EXPECT_EQ(FakeKernel::calls, 2);
}

// A child that has stopped for its tracer, this test.
class Traced {
 public:
  Traced() : pid_(fork()) {
    if (pid_ == 0) {
      if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == 0) raise(SIGSTOP);
      _exit(0);
    }
    int status = 0;
    waitpid(pid_, &status, 0);
    stopped_ = WIFSTOPPED(status);
  }
  ~Traced() {
    if (!stopped_) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Traced(const Traced&) = delete;
  Traced& operator=(const Traced&) = delete;

  pid_t pid() const { return pid_; }
  bool stopped() const { return stopped_; }

 private:
  pid_t pid_;
  bool stopped_ = false;
};

// The kernel of this machine, whatever its processor: 576 bytes (x87, SSE, header) are less than
// the area of each that has AVX.
TEST(WholeXstate, WritesAPartOnThisMachine) {
  const Traced child;
  if (!child.stopped()) GTEST_SKIP() << "ptrace is not allowed here";
  std::array<unsigned char, 64 * 1024> area{};
  iovec whole{area.data(), area.size()};
  ASSERT_EQ(RealPtrace(PTRACE_GETREGSET, child.pid(), kXstate, &whole), 0);
  if (whole.iov_len <= 576) GTEST_SKIP() << "this processor has no extended state";

  constexpr std::size_t kXmm0 = 160;
  constexpr std::size_t kStateBits = 512;
  Bytes part(area.begin(), area.begin() + 576);
  std::fill_n(part.begin() + kXmm0, 16, 0x5A);
  part[kStateBits] |= 2;  // SSE is in use
  iovec io{part.data(), part.size()};
  EXPECT_EQ(RealPtrace(PTRACE_SETREGSET, child.pid(), kXstate, &io), -1);
  EXPECT_EQ(PtraceWithWholeXstate(RealPtrace, PTRACE_SETREGSET, child.pid(), kXstate, &io), 0);

  std::array<unsigned char, 64 * 1024> after{};
  iovec read_back{after.data(), after.size()};
  ASSERT_EQ(RealPtrace(PTRACE_GETREGSET, child.pid(), kXstate, &read_back), 0);
  EXPECT_EQ(Bytes(after.begin() + kXmm0, after.begin() + kXmm0 + 16), Bytes(16, 0x5A));
  EXPECT_EQ(Bytes(after.begin() + 576, after.begin() + static_cast<long>(whole.iov_len)),
            Bytes(area.begin() + 576, area.begin() + static_cast<long>(whole.iov_len)));
}

}  // namespace
}  // namespace seastitch
