// SPDX-License-Identifier: GPL-3.0-or-later
#include "faults/fault_kinds.h"

#include <linux/stat.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>

namespace organbake::faults {
namespace {

constexpr unsigned kNeedsRoom = kWrites | kCloses;

constexpr Fault kFaults[] = {
    {"ENOSPC", kNeedsRoom, Way::fails, ENOSPC, false},
    {"full", kNeedsRoom, Way::fails, ENOSPC, true},
    {"EDQUOT", kNeedsRoom, Way::fails, EDQUOT, true},
    {"EROFS", kWrites | kRemoves, Way::fails, EROFS, true},
    {"EIO", kAll, Way::fails, EIO, false},
    {"dead", kReads | kWrites | kOpens | kAsks | kRemoves, Way::fails, EIO, true},
    {"EMFILE", kOpens, Way::fails, EMFILE, false},
    {"ENOMEM", kMaps, Way::fails, ENOMEM, false},
    {"EINTR", kMovesBytes, Way::fails, EINTR, false},
    {"short", kMovesBytes, Way::moves_half, 0, false},
    {"kill", kAll, Way::kills, 0, false},
    {"clock", kAsks, Way::turns_time, 0, true},
};

long half(const SystemCall& call, Arguments arguments) {
  const bool in_pieces = call.number == SYS_readv || call.number == SYS_writev;
  const std::size_t count = call.number == SYS_copy_file_range ? 4
                            : call.number == SYS_sendfile      ? 3
                                                               : 2;
  if (arguments[count] > 1) arguments[count] /= 2;
  iovec first;
  if (in_pieces && arguments[2] == 1) {
    first = *reinterpret_cast<const iovec*>(arguments[1]);
    if (first.iov_len > 1) first.iov_len /= 2;
    arguments[1] = reinterpret_cast<long>(&first);
  }
  return raw_call(call.number, arguments);
}

long with_other_times(const SystemCall& call, const Arguments& arguments) {
  const long result = raw_call(call.number, arguments);
  if (result != 0) return result;
  if (call.number == SYS_statx) {
    auto& status = *reinterpret_cast<struct statx*>(arguments[4]);
    status.stx_mtime.tv_sec = any_time();
    status.stx_ctime.tv_sec = any_time();
    status.stx_atime.tv_sec = any_time();
  } else if (call.number == SYS_stat || call.number == SYS_lstat || call.number == SYS_fstat ||
             call.number == SYS_newfstatat) {
    auto& status =
        *reinterpret_cast<struct stat*>(arguments[call.number == SYS_newfstatat ? 2 : 1]);
    status.st_mtim.tv_sec = any_time();
    status.st_ctim.tv_sec = any_time();
    status.st_atim.tv_sec = any_time();
  }
  return result;
}

}  // namespace

const Fault* find_fault(std::string_view name) {
  for (const Fault& fault : kFaults) {
    if (fault.name == name) return &fault;
  }
  return nullptr;
}

long befall(const Fault& fault, const SystemCall& call, const Arguments& arguments) {
  switch (fault.way) {
    case Way::moves_half:
      return half(call, arguments);
    case Way::turns_time:
      return with_other_times(call, arguments);
    case Way::kills:
      raw_call(SYS_kill, {raw_call(SYS_getpid, {}), SIGKILL});
      break;
    case Way::fails:
      break;
  }
  // A descriptor is gone even where closing it reports an error.
  if (call.number == SYS_close) raw_call(call.number, arguments);
  return -fault.error;
}

long any_time() {
  static std::atomic<unsigned> state{1};
  const unsigned next = state.fetch_add(0x9e3779b9u) * 0x85ebca6bu;
  return 631152000L + static_cast<long>(next ^ (next >> 15)) / 2;
}

}  // namespace organbake::faults
