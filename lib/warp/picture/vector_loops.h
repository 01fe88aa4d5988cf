// SPDX-License-Identifier: Apache-2.0
#pragma once

// For plain loops that carry a frame: compiled a second time for AVX-512, and chosen when the
// program is loaded, a sixteenth of a frame. Both give the same bits: the arithmetic is the same
// lane by lane, fused multiply-adds included. Sanitizers are not ready yet when it is chosen.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__) || \
    !defined(__AVX2__)
#define ORGANBAKE_MULTIVERSION
#else
#define ORGANBAKE_MULTIVERSION __attribute__((target_clones("default", "arch=x86-64-v4")))
#endif

// Before a loop over numbers of 64 bits beside such of 32: of vectors of 128 bits, clang would
// make it two lanes wide and halve all of the work for the few.
#if defined(__wasm_simd128__)
#define ORGANBAKE_FOUR_LANES _Pragma("clang loop vectorize_width(4)")
#else
#define ORGANBAKE_FOUR_LANES
#endif

namespace organbake {

// Such loops run over whole vectors of the widest kind: what lies beyond the last number is worked
// out, too, and its result is never read. A remainder is a loop of its own, number by number: as
// dear as the rest where a chunk or a row is as short as ours.
inline constexpr unsigned kLanes = 16;
constexpr unsigned whole_vectors(int count) {
  return (static_cast<unsigned>(count) + kLanes - 1) & ~(kLanes - 1);
}

}  // namespace organbake
