// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

// Memory that programs can have here: the machine's, or what a control group (cgroup v2: a
// container, a cluster's task) leaves of it. `total` whoever uses it now, `available` what is free
// for more, at least 1.
struct MachineMemory {
  double total_mb = 0, available_mb = 0;
};
MachineMemory machine_memory();

}  // namespace organbake
