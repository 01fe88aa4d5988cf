// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/lens_check.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

void check_lens_of_picture(const Intrinsics& lens, int width, int height,
                           const std::filesystem::path& path, const std::string& whose) {
  const std::string picture =
      (whose.empty() ? "the picture is " : "the " + whose + " one is ") + size_text(width, height);
  const std::string eye = whose.empty() ? "a" : "the " + whose + " eye's";
  if (lens.width != width || lens.height != height)
    throw BadDataError(path, "is of pictures of " + size_text(lens.width, lens.height) + ", " +
                                 picture + "; give the calibration of this size");
  // In widths of the picture: from 170° across to 3°.
  constexpr double kShortest = 0.04, kLongest = 20;
  for (const double focal : {lens.fx / width, lens.fy / height})
    if (!(focal >= kShortest && focal <= kLongest))
      throw BadDataError(path, "has " + eye + " focal length of " + to_text(lens.fx, 2) + ", " +
                                   to_text(lens.fy, 2) + " px, and " + picture +
                                   ": is it in shares of the sides, or of another size?");
  constexpr double kBothOffMiddle = 0.22, kOneOffMiddle = 0.4;
  const double x = std::abs(lens.cx / width - 0.5), y = std::abs(lens.cy / height - 0.5);
  if (!(std::min(x, y) <= kBothOffMiddle && std::max(x, y) <= kOneOffMiddle))
    throw BadDataError(path, "has " + eye + " principal point at " + to_text(lens.cx, 1) + ", " +
                                 to_text(lens.cy, 1) + ", far off the middle of a picture of " +
                                 size_text(width, height) + ": is it of another size?");
  lens.check();
}

}  // namespace organbake
