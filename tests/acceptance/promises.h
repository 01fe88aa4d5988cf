// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench.h"
#include "organbake/image/channel_image.h"
#include "support/testing.h"

// Tests that hold what is promised of whole stages, on more and larger inputs than unit tests have
// time for. Their seeds and inputs are the same in every run; none asserts a time.
namespace organbake {

// Prints a figure, keeps it in the test's XML report, and expects that it reaches its target.
void expect(const Figure& figure);
// The same of a number of which nothing is promised.
void report(const std::string& what, const std::string& unit, double value);

// How many cases, views or frames: `thorough` where ORGANBAKE_THOROUGH is set in the environment.
int cases(int standard, int thorough);
// Which seeds: from ORGANBAKE_FIRST_CASE on (0), ORGANBAKE_CASES of them, else as many as cases().
struct Seeds {
  std::uint64_t first, count;
};
Seeds asked_seeds(int standard, int thorough);

// Writes a picture for people to look at into the folder that ORGANBAKE_PICTURES names, as the
// test's name and this one with .png; nowhere when it names none.
void show(const Rgb8Image& picture, const std::string& name);

// Places in which two sequences of one length are not the same.
template <class Sequence>
double count_different(const Sequence& a, const Sequence& b) {
  double count = 0;
  for (std::size_t k = 0; k < a.size(); ++k) count += a[k] != b[k];
  return count;
}

}  // namespace organbake
