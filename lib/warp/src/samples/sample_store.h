// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "organbake/core/background_thread.h"
#include "samples/sample_set.h"

namespace organbake {

// The sample sets of a bundle's cameras, each made when a view first needs it and kept from then
// on: a view needs three, a bundle may have dozens. What is made, and so every frame, does not
// depend on when.
class SampleStore {
 public:
  // Called once per camera, from any thread; once more when it threw.
  using Make = std::function<SampleSet(std::size_t camera)>;

  SampleStore(std::size_t cameras, Make make);
  ~SampleStore();  // waits for the camera that is being made ahead

  // Makes those of the cameras that are not there yet, side by side. Throws what making one throws.
  void require(std::span<const std::size_t> cameras);
  void require_all();
  // Starts a thread of its own that makes all the others, in order, where the build has threads.
  // What fails there is tried again, and thrown, when it is required.
  void make_ahead();
  // Makes the first that is not there yet, for who has no thread to spare. False: all are there.
  // Not beside make_ahead().
  bool make_next();

  // Of one camera, made when it is not there yet.
  const SampleSet& made(std::size_t camera);
  // Of a camera that was required.
  const SampleSet& operator[](std::size_t camera) const;

 private:
  struct Slot;
  void require_one(std::size_t camera);

  std::size_t count_;
  std::unique_ptr<Slot[]> slots_;
  Make make_;
  std::size_t next_ = 0;    // all before it were made
  BackgroundThread ahead_;  // last: it ends while the rest is there
};

}  // namespace organbake
