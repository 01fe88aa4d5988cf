// SPDX-License-Identifier: GPL-3.0-or-later
// A level for a CT without any: Otsu's threshold (1979) parts the histogram in two classes, and the
// level lies half-way between their peaks, where a voxel is half one tissue and half the other.
// Otsu's own threshold leans to the larger class.
#include "proposed_level.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr int kValues = 65536;
// Peaks are looked for through this window, wide enough for a CT's noise to leave one summit.
constexpr int kHalfWindow_hu = 10;

// Whole numbers have a bin each; the span of others is parted as a CT's.
struct Histogram {
  std::vector<double> counts = std::vector<double>(kValues, 0);
  double lowest = std::numeric_limits<std::int16_t>::min(), bin = 1;
  int bins = kValues;

  double value(double at) const { return lowest + bin * at; }
};

Histogram histogram_of(const Volume& ct) {
  constexpr int kBinsOfOthers = 4096;
  Histogram histogram;
  if (ct.is_real()) {
    const ValueRange range = value_range(ct);
    histogram.bins = kBinsOfOthers;
    histogram.bin = (range.max - range.min) / (kBinsOfOthers - 1);
    histogram.lowest = range.min;
  }
  with_values(ct, [&](const auto values) {
    for (const auto value : values) {
      if constexpr (std::is_integral_v<decltype(value + 0)>) {
        ++histogram
              .counts[static_cast<std::size_t>(value - std::numeric_limits<std::int16_t>::min())];
      } else {
        const double at = (value - histogram.lowest) / histogram.bin;
        if (at >= 0) ++histogram.counts[static_cast<std::size_t>(at + 0.5)];
      }
    }
  });
  return histogram;
}

// The first bin of the upper class.
int otsu_split(const std::vector<double>& counts) {
  double all = 0, sum = 0;
  for (int i = 0; i < kValues; ++i) {
    all += counts[i];
    sum += counts[i] * i;
  }
  double below = 0, sum_below = 0, best = -1;
  int split = 0;
  for (int i = 0; i < kValues - 1; ++i) {
    below += counts[i];
    sum_below += counts[i] * i;
    if (below == 0 || below == all) continue;
    const double apart = sum_below / below - (sum - sum_below) / (all - below);
    const double between = below * (all - below) * apart * apart;
    if (between > best) {
      best = between;
      split = i + 1;
    }
  }
  if (best < 0) throw BadDataError("all voxels have one value; there is no level to propose");
  return split;
}

// The value round which [first, end) has most voxels. The window may reach beyond both ends, or a
// peak at an end would be seen from one side only.
double peak(const std::vector<double>& counts, int first, int end) {
  double in_window = 0, most = -1, at = first;
  int plateau = 0;
  for (int i = first - kHalfWindow_hu; i < end + kHalfWindow_hu; ++i) {
    const int enters = i + kHalfWindow_hu, leaves = i - kHalfWindow_hu - 1;
    if (enters >= first && enters < end) in_window += counts[enters];
    if (leaves >= first && leaves < end) in_window -= counts[leaves];
    if (in_window > most) {
      most = in_window;
      at = i;
      plateau = 0;
    } else if (in_window == most && i == at + plateau + 1) {
      ++plateau;  // a single sharp value looks the same from anywhere in the window
    }
  }
  return at + plateau / 2;
}

std::string hu_text(double value) {
  return value < 0 ? "−" + to_text(-value) : to_text(value + 0.0);
}

}  // namespace

std::string ProposedLevel::reason() const {
  return "half-way between the peaks at " + hu_text(low_peak_hu) + " and " + hu_text(high_peak_hu);
}

ProposedLevel propose_level(const Volume& ct) {
  const Histogram histogram = histogram_of(ct);
  const int split = otsu_split(histogram.counts);
  ProposedLevel proposed;
  proposed.low_peak_hu = histogram.value(peak(histogram.counts, 0, split));
  proposed.high_peak_hu = histogram.value(peak(histogram.counts, split, histogram.bins));
  proposed.level_hu = 0.5 * (proposed.low_peak_hu + proposed.high_peak_hu);
  return proposed;
}

}  // namespace organbake
