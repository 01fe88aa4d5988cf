// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// While it lives its thread does the parallel loops that it comes to alone: for when the other
// threads have work of their own, and sharing would cost more than it brings.
class OneThread {
 public:
  OneThread();
  ~OneThread();
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  bool before_;
};

}  // namespace organbake
