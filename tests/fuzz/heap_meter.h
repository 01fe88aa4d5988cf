// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace organbake {

// The most memory that malloc had given out at once, by whatever library asked for it, beyond what
// was given out when the meter was made. Whoever links heap_meter.cpp has its malloc counted; under
// a sanitizer, which has a malloc of its own, nothing is counted and the answer is 0.
class HeapMeter {
 public:
  HeapMeter();
  std::size_t most_bytes() const;

 private:
  std::size_t at_start_;
};

}  // namespace organbake
