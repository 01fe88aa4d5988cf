// SPDX-License-Identifier: Apache-2.0
// Compiled for any x86-64, and run before the constructors of the code that is not: on an old
// processor a program says what is wrong instead of dying of an illegal instruction.
#include <errno.h>
#include <string.h>
#include <unistd.h>

namespace {

constexpr int kInternalError = 70;  // ExitCode::internal; no header with AVX2 code is included here

bool is_new_enough() {
  __builtin_cpu_init();
#ifdef __clang__  // which has no name for the level
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
  return __builtin_cpu_supports("x86-64-v3");
#endif
}

// The first priority that is not reserved for the implementation.
__attribute__((constructor(101))) void check_processor() {
  if (is_new_enough()) return;
  const char* const parts[] = {
      program_invocation_short_name,
      ": this processor is too old: AVX2 and FMA are needed (Intel since 2013, AMD since 2015)\n"};
  for (const char* part : parts) {
    if (write(STDERR_FILENO, part, strlen(part)) < 0) break;
  }
  _exit(kInternalError);
}

}  // namespace
