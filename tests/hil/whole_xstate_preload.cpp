// Preloaded into User-Mode Linux by in_guest.sh. Debian 12's linux.uml keeps 2,696 bytes of
// extended processor state, up to AVX-512. A processor with AMX (Sapphire Rapids and later) has
// more, so that no process of the guest could start: "ptrace set fp regs failed, errno = 14".
#include <dlfcn.h>

#include <cstdarg>

#include "tests/hil/whole_xstate.hpp"

namespace {

// Found before main(): dlsym() is not for the small stacks of later calls.
const auto real_ptrace = reinterpret_cast<seastitch::PtraceCall>(dlsym(RTLD_NEXT, "ptrace"));

}  // namespace

extern "C" long ptrace(__ptrace_request request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  const pid_t pid = va_arg(arguments, pid_t);
  void* const address = va_arg(arguments, void*);
  void* const data = va_arg(arguments, void*);
  va_end(arguments);
  return seastitch::PtraceWithWholeXstate(real_ptrace, request, pid, address, data);
}
