// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace organbake::faults {

// What a system call does to files; a fault names those that it hits.
enum Effect : unsigned {
  kReads = 1,         // bytes or entries of a folder are asked for
  kWrites = 2,        // something on the disk grows or changes
  kOpens = 4,         // a file gets a descriptor
  kAsks = 8,          // only properties are asked for
  kMaps = 16,         // a file is mapped
  kCloses = 32,       // some file systems report only here, or when asked to sync, what went wrong
  kRemoves = 64,      // a file or folder goes
  kMovesBytes = 128,  // as many bytes as the call says, which may be fewer than asked for
  kAll = 255,
};

struct SystemCall {
  long number;
  const char* name;
  unsigned effects;
  int subject;   // the argument that says which file
  bool by_path;  // the subject is a path; else a descriptor
};

using Arguments = std::array<long, 6>;

std::span<const SystemCall> all_calls();
const SystemCall* find_call(long number);

// A file that is opened to be written changes the disk, one that is opened to be read does not;
// closing that one never fails.
unsigned effects_of(const SystemCall& call, const Arguments& arguments);

// The call itself, without any detour: it returns the result, or −errno.
long raw_call(long number, const Arguments& arguments);
// The address that the kernel sees calls of raw_call() come from.
std::uintptr_t raw_call_origin();

}  // namespace organbake::faults
