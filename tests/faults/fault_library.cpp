// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded into a program, it makes one of its system calls fail. The kernel hands it every call
// that all_calls() names, those inside libc and the dynamic loader as well, as a signal (seccomp's
// SECCOMP_RET_TRAP); wrappers of libc's functions would miss what stdio and dlopen do. From the
// environment:
//   FAULT_KIND  the name of a fault: which calls are counted, and what befalls the chosen one
//   FAULT_AT    the number of that call, from 1; 0: none, they are only counted
//   FAULT_LOG   a file that gets a line for each: number, name, file
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "faults/fault_kinds.h"
#include "faults/system_calls.h"

namespace organbake::faults {
namespace {

const Fault* chosen = nullptr;
long fault_at = 0;
int log_file = -1;
std::atomic<long> counted{0};

long address(const void* pointer) { return reinterpret_cast<long>(pointer); }

void write_log(long number, const SystemCall& call, long subject) {
  if (log_file < 0) return;
  char path[512] = "", line[600];
  if (call.number == SYS_getcwd) {
    // What it names is where the answer goes.
  } else if (call.by_path) {
    std::snprintf(path, sizeof path, "%s", reinterpret_cast<const char*>(subject));
  } else {
    char link[64];
    std::snprintf(link, sizeof link, "/proc/self/fd/%ld", subject);
    const long length = raw_call(SYS_readlink, {address(link), address(path), sizeof path - 1});
    path[std::max(0L, length)] = '\0';
  }
  const int length = std::snprintf(line, sizeof line, "%ld %s %s\n", number, call.name, path);
  raw_call(SYS_write, {log_file, address(line), std::min<long>(length, sizeof line - 1)});
}

long perform(const SystemCall& call, const Arguments& arguments) {
  const long subject = arguments[static_cast<std::size_t>(call.subject)];
  // Without its messages nobody could tell how the program ended.
  const bool spared = !call.by_path && (subject == STDERR_FILENO || subject == log_file);
  if (spared || !(effects_of(call, arguments) & chosen->hits))
    return raw_call(call.number, arguments);
  const long number = ++counted;
  write_log(number, call, subject);
  const bool befallen = fault_at > 0 && (chosen->lasts ? number >= fault_at : number == fault_at);
  return befallen ? befall(*chosen, call, arguments) : raw_call(call.number, arguments);
}

void on_call(int, siginfo_t* info, void* context) {
  auto& registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  const Arguments arguments = {registers[REG_RDI], registers[REG_RSI], registers[REG_RDX],
                               registers[REG_R10], registers[REG_R8],  registers[REG_R9]};
  registers[REG_RAX] = perform(*find_call(info->si_syscall), arguments);
}

// All calls of the table lead to the signal, but raw_call()'s; memory that is mapped has nothing to
// do with files.
std::vector<sock_filter> call_filter() {
  const auto load = [](std::size_t offset) {
    return sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offset));
  };
  const auto skip_unless = [](std::uint64_t value, unsigned char count) {
    return sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(value), 0, count);
  };
  const sock_filter allow BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  const sock_filter trap BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP);
  const sock_filter skip_if_memory BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, MAP_ANONYMOUS, 0, 1);
  const std::size_t origin = offsetof(seccomp_data, instruction_pointer);
  std::vector<sock_filter> steps = {load(origin),
                                    skip_unless(raw_call_origin() & 0xffffffffu, 3),
                                    load(origin + 4),
                                    skip_unless(raw_call_origin() >> 32, 1),
                                    allow,
                                    load(offsetof(seccomp_data, nr)),
                                    skip_unless(SYS_mmap, 4),
                                    load(offsetof(seccomp_data, args[3])),
                                    skip_if_memory,
                                    allow,
                                    trap};
  for (const SystemCall& call : all_calls()) {
    steps.push_back(skip_unless(static_cast<std::uint64_t>(call.number), 1));
    steps.push_back(trap);
  }
  steps.push_back(allow);
  return steps;
}

[[noreturn]] void give_up(const char* why) {
  std::fprintf(stderr, "faults: %s\n", why);
  std::_Exit(77);
}

void open_log(const char* path) {
  const int low = ::open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  log_file = ::fcntl(low, F_DUPFD_CLOEXEC, 900);  // the program's own numbers stay as they were
  ::close(low);
  if (log_file < 0) give_up("FAULT_LOG cannot be written");
}

__attribute__((constructor)) void start() {
  const char* kind = std::getenv("FAULT_KIND");
  if (!kind) return;
  const Fault* fault = find_fault(kind);
  if (!fault) give_up("FAULT_KIND is none of those that there are");
  if (const char* at = std::getenv("FAULT_AT")) fault_at = std::atol(at);
  if (const char* log = std::getenv("FAULT_LOG")) open_log(log);
  chosen = fault;
  struct sigaction action {};
  action.sa_sigaction = on_call;
  action.sa_flags = SA_SIGINFO | SA_NODEFER | SA_RESTART;
  ::sigaction(SIGSYS, &action, nullptr);
  std::vector<sock_filter> steps = call_filter();
  const sock_fprog filter{static_cast<unsigned short>(steps.size()), steps.data()};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0)
    give_up("this system lets no program filter its calls (seccomp)");
}

bool turns_time() { return chosen && chosen->way == Way::turns_time && fault_at > 0; }

}  // namespace
}  // namespace organbake::faults

// The clock is read without a system call. What only ever runs on is left alone.
extern "C" int clock_gettime(clockid_t clock, timespec* time) {
  using namespace organbake::faults;
  const long result = raw_call(SYS_clock_gettime, {clock, address(time)});
  if (result == 0 && clock == CLOCK_REALTIME && turns_time()) time->tv_sec = any_time();
  return result == 0 ? 0 : -1;
}

extern "C" std::time_t time(std::time_t* where) {
  timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (where) *where = now.tv_sec;
  return now.tv_sec;
}

extern "C" int gettimeofday(timeval* where, void*) {
  timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  *where = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}
