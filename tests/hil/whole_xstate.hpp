#pragma once

#include <elf.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace seastitch {

using PtraceCall = long (*)(__ptrace_request request, pid_t pid, void* address, void* data);

// ptrace() for a tracer whose buffer for the extended processor state (XSAVE area) is shorter than
// this processor's. Linux reads a part of the area, but writes only all of it: PTRACE_SETREGSET of
// a part fails with EFAULT. Such a write is completed with what the traced process has in the rest
// of its area, and tried once more. Every other call goes to `real` as it came. Not for two threads
// at once, and without a heap: User-Mode Linux has one thread and its own malloc.
inline long PtraceWithWholeXstate(
    PtraceCall real, __ptrace_request request, pid_t pid, void* address, void* data) {
  const long result = real(request, pid, address, data);
  const bool is_xstate_write =
      request == PTRACE_SETREGSET && address == reinterpret_cast<void*>(NT_X86_XSTATE);
  if (result == 0 || errno != EFAULT || !is_xstate_write) return result;

  // 11,008 bytes with AMX. Static: the kernel stacks of User-Mode Linux are small.
  alignas(64) static unsigned char area[64 * 1024];
  iovec whole{area, sizeof area};
  if (real(PTRACE_GETREGSET, pid, address, &whole) != 0) return -1;
  const auto* part = static_cast<const iovec*>(data);
  std::memcpy(area, part->iov_base, std::min(part->iov_len, whole.iov_len));
  return real(PTRACE_SETREGSET, pid, address, &whole);
}

}  // namespace seastitch
