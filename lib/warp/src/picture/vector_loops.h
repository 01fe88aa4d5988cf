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

// Before a loop whose numbers are not all of one width: clang counts a vector's lanes by the
// widest, and of vectors of 128 bits two or four are left where the most of the work would take
// twice that.
#if defined(__wasm_simd128__)
#define ORGANBAKE_LANES_PRAGMA(text) _Pragma(#text)
#define ORGANBAKE_LANES(count) ORGANBAKE_LANES_PRAGMA(clang loop vectorize_width(count))
#else
#define ORGANBAKE_LANES(count)
#endif

// Before a loop none of whose steps reads what another writes: g++ gives up on a loop that would
// need more than ten checks of that at run time, as those over many planes would, and takes number
// by number. (clang's word for it demands the vectors, and warns where it makes none.)
#if defined(__clang__)
#define ORGANBAKE_INDEPENDENT
#else
#define ORGANBAKE_INDEPENDENT _Pragma("GCC ivdep")
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
