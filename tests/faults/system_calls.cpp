// SPDX-License-Identifier: GPL-3.0-or-later
#include "faults/system_calls.h"

#include <fcntl.h>
#include <sys/syscall.h>

extern "C" {
__attribute__((visibility("hidden"))) long organbake_raw_call(long number, const long* arguments);
__attribute__((visibility("hidden"))) extern const char organbake_raw_call_return[];
}

asm(R"(
  .text
  .hidden organbake_raw_call
  .globl organbake_raw_call
  .type organbake_raw_call, @function
organbake_raw_call:
  mov %rdi, %rax
  mov %rsi, %r11
  mov 0(%r11), %rdi
  mov 8(%r11), %rsi
  mov 16(%r11), %rdx
  mov 24(%r11), %r10
  mov 32(%r11), %r8
  mov 40(%r11), %r9
  syscall
  .hidden organbake_raw_call_return
  .globl organbake_raw_call_return
organbake_raw_call_return:
  ret
)");

namespace organbake::faults {
namespace {

constexpr bool kPath = true, kDescriptor = false;

constexpr SystemCall kCalls[] = {
    {SYS_open, "open", kOpens, 0, kPath},
    {SYS_openat, "openat", kOpens, 1, kPath},
    {SYS_creat, "creat", kOpens, 0, kPath},
    {SYS_read, "read", kReads | kMovesBytes, 0, kDescriptor},
    {SYS_readv, "readv", kReads | kMovesBytes, 0, kDescriptor},
    {SYS_pread64, "pread", kReads | kMovesBytes, 0, kDescriptor},
    {SYS_getdents64, "getdents", kReads, 0, kDescriptor},
    {SYS_write, "write", kWrites | kMovesBytes, 0, kDescriptor},
    {SYS_writev, "writev", kWrites | kMovesBytes, 0, kDescriptor},
    {SYS_pwrite64, "pwrite", kWrites | kMovesBytes, 0, kDescriptor},
    {SYS_copy_file_range, "copy_file_range", kReads | kWrites | kMovesBytes, 2, kDescriptor},
    {SYS_sendfile, "sendfile", kReads | kWrites | kMovesBytes, 0, kDescriptor},
    {SYS_ftruncate, "ftruncate", kWrites, 0, kDescriptor},
    {SYS_fallocate, "fallocate", kWrites, 0, kDescriptor},
    {SYS_fsync, "fsync", kCloses, 0, kDescriptor},
    {SYS_fdatasync, "fdatasync", kCloses, 0, kDescriptor},
    {SYS_close, "close", kCloses, 0, kDescriptor},
    {SYS_mkdir, "mkdir", kWrites, 0, kPath},
    {SYS_mkdirat, "mkdirat", kWrites, 1, kPath},
    {SYS_rename, "rename", kWrites, 1, kPath},
    {SYS_renameat, "renameat", kWrites, 3, kPath},
    {SYS_renameat2, "renameat2", kWrites, 3, kPath},
    {SYS_link, "link", kWrites, 1, kPath},
    {SYS_linkat, "linkat", kWrites, 3, kPath},
    {SYS_symlink, "symlink", kWrites, 1, kPath},
    {SYS_fchmod, "fchmod", kWrites, 0, kDescriptor},
    {SYS_fchmodat, "fchmodat", kWrites, 1, kPath},
    {SYS_utimensat, "utimensat", kWrites, 1, kPath},
    {SYS_unlink, "unlink", kRemoves, 0, kPath},
    {SYS_unlinkat, "unlinkat", kRemoves, 1, kPath},
    {SYS_rmdir, "rmdir", kRemoves, 0, kPath},
    {SYS_stat, "stat", kAsks, 0, kPath},
    {SYS_lstat, "lstat", kAsks, 0, kPath},
    {SYS_fstat, "fstat", kAsks, 0, kDescriptor},
    {SYS_newfstatat, "newfstatat", kAsks, 1, kPath},
    {SYS_statx, "statx", kAsks, 1, kPath},
    {SYS_statfs, "statfs", kAsks, 0, kPath},
    {SYS_access, "access", kAsks, 0, kPath},
    {SYS_faccessat2, "faccessat2", kAsks, 1, kPath},
    {SYS_readlink, "readlink", kAsks, 0, kPath},
    {SYS_readlinkat, "readlinkat", kAsks, 1, kPath},
    {SYS_getcwd, "getcwd", kAsks, 0, kPath},
    {SYS_mmap, "mmap", kMaps, 4, kDescriptor},
};

}  // namespace

std::span<const SystemCall> all_calls() { return kCalls; }

const SystemCall* find_call(long number) {
  for (const SystemCall& call : kCalls) {
    if (call.number == number) return &call;
  }
  return nullptr;
}

unsigned effects_of(const SystemCall& call, const Arguments& arguments) {
  if (call.number == SYS_close) {
    const long flags = raw_call(SYS_fcntl, {arguments[0], F_GETFL});
    return flags >= 0 && (flags & O_ACCMODE) != O_RDONLY ? call.effects : 0;
  }
  if (!(call.effects & kOpens)) return call.effects;
  const long flags = call.number == SYS_creat
                         ? O_WRONLY | O_CREAT
                         : arguments[static_cast<std::size_t>(call.subject) + 1];
  const bool to_write = (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT);
  return call.effects | (to_write ? kWrites : 0u);
}

long raw_call(long number, const Arguments& arguments) {
  return organbake_raw_call(number, arguments.data());
}

std::uintptr_t raw_call_origin() {
  return reinterpret_cast<std::uintptr_t>(organbake_raw_call_return);
}

}  // namespace organbake::faults
