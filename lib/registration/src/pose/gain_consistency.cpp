// SPDX-License-Identifier: GPL-3.0-or-later
#include "pose/refine.h"

#include <map>

namespace organbake {
namespace {

// Weighted least squares of the photograph's a by gain · b + offset.
struct LineFit {
  double w = 0, a = 0, b = 0, aa = 0, ab = 0, bb = 0;

  void add(double weight, double photo, double predicted) {
    w += weight;
    a += weight * photo;
    b += weight * predicted;
    aa += weight * photo * photo;
    ab += weight * photo * predicted;
    bb += weight * predicted * predicted;
  }
  // The sum of squares that is left.
  double unexplained() const {
    if (!(w > 0)) return 0;
    const double saa = aa - a * a / w, sab = ab - a * b / w, sbb = bb - b * b / w;
    return sbb > 0 ? saa - sab * sab / sbb : saa;
  }
};

}  // namespace

bool one_gain_fits_all(const LivePrediction& live, const std::vector<WeightedPixel>& pixels,
                       int side) {
  // Squares of 24² pixels have 0.4 % fewer freedoms than pixels, and those cut by the outline more.
  constexpr double kNoiseAlone = 1.05;
  LineFit whole;
  std::map<std::pair<int, int>, LineFit> squares;
  for (const WeightedPixel& p : pixels) {
    const double photo = live.level().luminance[live.level().index(p.x, p.y)];
    const double predicted = live.radiance(p.x, p.y);
    whole.add(p.weight, photo, predicted);
    squares[{p.y / side, p.x / side}].add(p.weight, photo, predicted);
  }
  double by_squares = 0;
  for (const auto& [cell, square] : squares) by_squares += square.unexplained();
  return by_squares > 0 && whole.unexplained() <= kNoiseAlone * by_squares;
}

}  // namespace organbake
