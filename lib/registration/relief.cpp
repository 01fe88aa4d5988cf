// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/relief.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace organbake {
namespace {

constexpr int kHalfSquare = 14;      // pixels: half a square's side
constexpr int kSquaresApart = 14;    // pixels between squares
constexpr int kSquareReach = 8;      // pixels of shift
constexpr int kSquareConfirmed = 2;  // pixels
constexpr int kTold = 4;             // pixels of shift that the prediction itself tells …
constexpr double kTells = 0.985;  // … by agreeing less with itself than this, whatever direction

using Square = std::vector<float>;  // row by row, centred, of unit norm; empty: constant

// Of a plane of width `stride`.
Square square_at(const std::vector<float>& plane, std::size_t stride, std::size_t top_left) {
  constexpr int kSide = 2 * kHalfSquare + 1;
  constexpr double kLeastContrast = 0.002;  // RMS, of the luminance range
  Square square;
  square.reserve(kSide * kSide);
  double sum = 0, sum2 = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const float value = plane[top_left + std::size_t(y) * stride + std::size_t(x)];
      square.push_back(value);
      sum += value;
      sum2 += double(value) * value;
    }
  const double count = kSide * kSide, mean = sum / count;
  const double norm = std::sqrt(std::max(0.0, sum2 - sum * mean));
  if (norm < kLeastContrast * std::sqrt(count)) return {};
  for (float& value : square) value = static_cast<float>((value - mean) / norm);
  return square;
}

double agreement(const Square& a, const Square& b) {
  if (a.empty() || b.empty()) return -2;
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double(a[i]) * b[i];
  return sum;
}

class Squares {
 public:
  Squares(const PhotoLevel& level, const Prediction& p) : level_(level), p_(p) {}

  // Skin all over, at a distance from cuts and outlines, and counted.
  bool is_skin(int x, int y) const {
    constexpr float kFromCut = 4;  // pixels
    const int far = kHalfSquare + kSquareReach;
    const Intrinsics& k = level_.intrinsics;
    if (x < far || y < far || x + far >= k.width || y + far >= k.height) return false;
    if (!p_.contains(x - far, y - far) || !p_.contains(x + far, y + far)) return false;
    for (int v = y - far; v <= y + far; v += 2)
      for (int u = x - far; u <= x + far; u += 2) {
        const std::size_t i = p_.index(u, v);
        if (p_.coverage[i] < 1 || !level_.valid[level_.index(u, v)]) return false;
        if (!p_.border_px.empty() && p_.border_px[i] < kFromCut) return false;
      }
    return true;
  }
  Square predicted(int x, int y) const {
    return square_at(p_.radiance, std::size_t(p_.width),
                     p_.index(x - kHalfSquare, y - kHalfSquare));
  }
  Square seen(int x, int y) const {
    return square_at(level_.luminance, std::size_t(level_.intrinsics.width),
                     level_.index(x - kHalfSquare, y - kHalfSquare));
  }

 private:
  const PhotoLevel& level_;
  const Prediction& p_;
};

bool tells_where(const Squares& squares, const Square& own, int x, int y) {
  if (own.empty()) return false;
  const int steps[][2] = {{kTold, 0}, {0, kTold}, {kTold - 1, kTold - 1}, {kTold - 1, 1 - kTold}};
  return std::all_of(std::begin(steps), std::end(steps), [&](const int(&step)[2]) {
    return agreement(own, squares.predicted(x + step[0], y + step[1])) < kTells &&
           agreement(own, squares.predicted(x - step[0], y - step[1])) < kTells;
  });
}

bool is_confirmed(const Squares& squares, const Square& own, int x, int y) {
  double best = -2, best_distance = 0;
  for (int v = -kSquareReach; v <= kSquareReach; ++v)
    for (int u = -kSquareReach; u <= kSquareReach; ++u) {
      const double value = agreement(own, squares.seen(x + u, y + v));
      if (value > best) best = value, best_distance = std::hypot(u, v);
    }
  return best > -1 && best_distance <= kSquareConfirmed;
}

}  // namespace

ReliefCheck check_relief(const PhotoLevel& level, const Prediction& p) {
  const Squares squares(level, p);
  ReliefCheck check;
  int confirmed = 0;
  for (int y = p.top; y < p.top + p.height; y += kSquaresApart)
    for (int x = p.left; x < p.left + p.width; x += kSquaresApart) {
      if (!squares.is_skin(x, y)) continue;
      const Square own = squares.predicted(x, y);
      if (!tells_where(squares, own, x, y)) continue;
      ++check.asked;
      confirmed += is_confirmed(squares, own, x, y);
    }
  if (check.asked > 0) check.share = static_cast<double>(confirmed) / check.asked;
  return check;
}

}  // namespace organbake
