// SPDX-License-Identifier: Apache-2.0
#include "samples/patch.h"

#include "picture/vector_loops.h"

namespace organbake {

PatchTable::PatchTable(std::span<const Patch> patches) {
  faces_.reserve(patches.size());
  for (auto& numbers : numbers_) numbers.reserve(patches.size() + kLanes);
  for (const Patch& p : patches) {
    faces_.push_back(p.face);
    auto next = numbers_.begin();
    for (const auto* triple : {&p.center, &p.extent, &p.along_u, &p.along_v})
      for (const float number : *triple) (next++)->push_back(number);
    (next++)->push_back(p.cone.sine);
    next->push_back(p.cone.cosine);
  }
  for (auto& numbers : numbers_) numbers.resize(patches.size() + kLanes);
}

}  // namespace organbake
