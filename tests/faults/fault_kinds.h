// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

#include "faults/system_calls.h"

namespace organbake::faults {

enum class Way { fails, moves_half, kills, turns_time };

struct Fault {
  const char* name;
  unsigned hits;  // effects of the calls that are counted
  Way way;
  int error;   // errno
  bool lasts;  // so do all later ones
};

// nullptr: there is none of that name.
const Fault* find_fault(std::string_view name);

// What the call returns to the program that the fault befalls: its result, or −errno.
long befall(const Fault& fault, const SystemCall& call, const Arguments& arguments);

// Some time between 1990 and 2058 that has nothing to do with the one before.
long any_time();

}  // namespace organbake::faults
