// SPDX-License-Identifier: GPL-3.0-or-later
#include "suites/shading_pictures.h"

#include <algorithm>
#include <cmath>

#include "bench.h"
#include "organbake/core/text.h"
#include "organbake/image/srgb.h"
#include "organbake/player/contact_sheet.h"
#include "report/error_pictures.h"

namespace organbake {

void show_worst_scene(Bench& bench, const WorstScene& worst) {
  constexpr double kWhite_percent = 5;
  const std::size_t count = worst.log_range.size();
  double shift = 0;  // one scale is fitted
  for (std::size_t k = 0; k < count; ++k)
    shift += (worst.scene.log_range.values[k] - worst.log_range.values[k]) / double(count);
  std::vector<double> percent;
  Rgb8Image photo(worst.scene.intensity.width, worst.scene.intensity.height);
  for (std::size_t k = 0; k < count; ++k) {
    percent.push_back(100 * std::abs(std::exp(worst.log_range.values[k] + shift -
                                              worst.scene.log_range.values[k]) -
                                     1));
    std::fill_n(&photo.pixels[3 * k], 3, srgb8_from_linear(worst.scene.intensity.values[k]));
  }
  bench.show(tile_pictures({photo, heat_map(percent, photo.width, kWhite_percent)}, 2, 2),
             "The worst: " + worst.task +
                 ", as the camera sees it, and the error of its depth. "
                 "Black is none, white " +
                 to_text(kWhite_percent) + " % or more.");
}

}  // namespace organbake
