// SPDX-License-Identifier: GPL-3.0-or-later
// The light that explains a photograph best at a pose, by robust least squares (Geman & McClure
// 1987), and which pixels take part. The overlap is fixed while a solver runs: otherwise it could
// raise the correlation by showing less.
#include "appearance/appearance.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "organbake/core/median.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The mask of those of the window's pixels that are `in`, grown by `band` pixels, rows and columns
// apart.
template <class In>
std::vector<std::uint8_t> grown(const Prediction& p, int band, const In& in) {
  std::vector<std::uint8_t> along(p.coverage.size(), 0), both(p.coverage.size(), 0);
  for (int y = 0; y < p.height; ++y)
    for (int x = 0, last = -2 * band - 2; x < p.width + band; ++x) {
      if (x < p.width && in(std::size_t(y) * p.width + x)) last = x;
      const int u = x - band;
      if (u >= 0 && x - last <= 2 * band) along[std::size_t(y) * p.width + u] = 1;
    }
  for (int x = 0; x < p.width; ++x)
    for (int y = 0, last = -2 * band - 2; y < p.height + band; ++y) {
      if (y < p.height && along[std::size_t(y) * p.width + x]) last = y;
      const int v = y - band;
      if (v >= 0 && y - last <= 2 * band) both[std::size_t(v) * p.width + x] = 1;
    }
  return both;
}

class Fit {
 public:
  Fit(const PhotoLevel& level, const Prediction& p, int basis)
      : level_(level), p_(p), basis_(basis) {}

  // Weighted normal equations; a touch of ridge where the basis cannot be told apart.
  VectorXd solve(const std::vector<WeightedPixel>& pixels) const {
    constexpr double kRidge = 1e-7;
    const int n = basis_ + 1;
    MatrixXd normal = MatrixXd::Zero(n, n);
    VectorXd right = VectorXd::Zero(n), row(n);
    for (const WeightedPixel& pixel : pixels) {
      if (!(pixel.weight > 0)) continue;
      fill(pixel, row);
      for (int j = 0; j < n; ++j)
        for (int k = 0; k <= j; ++k) normal(j, k) += pixel.weight * row[j] * row[k];
      right += pixel.weight * photo(pixel) * row;
    }
    normal.diagonal() += kRidge * normal.diagonal() + VectorXd::Constant(n, 1e-12);
    return solve_symmetric(normal, right);
  }
  double residual(const WeightedPixel& pixel, const VectorXd& solution) const {
    const float* phi = p_.phi_at(p_.index(pixel.x, pixel.y));
    double predicted = solution[basis_];
    for (int j = 0; j < basis_; ++j) predicted += solution[j] * phi[j];
    return photo(pixel) - predicted;
  }
  bool on_organ(const WeightedPixel& pixel) const {
    return p_.coverage[p_.index(pixel.x, pixel.y)] > 0;
  }

 private:
  void fill(const WeightedPixel& pixel, VectorXd& row) const {
    const float* phi = p_.phi_at(p_.index(pixel.x, pixel.y));
    for (int j = 0; j < basis_; ++j) row[j] = phi[j];
    row[basis_] = 1;
  }
  double photo(const WeightedPixel& pixel) const {
    return level_.luminance[level_.index(pixel.x, pixel.y)];
  }

  const PhotoLevel& level_;
  const Prediction& p_;
  int basis_;
};

// Pixels far off count little.
void weigh(const Fit& fit, const VectorXd& solution, double noise,
           std::vector<WeightedPixel>& pixels) {
  constexpr double kCutoff = 4;  // standard deviations at which a pixel counts a quarter
  for (WeightedPixel& pixel : pixels) {
    const double off = fit.residual(pixel, solution) / (kCutoff * noise);
    pixel.weight = pixel.trust * robust_weight(off * off);
  }
}

// Every n-th pixel: a light has a dozen numbers, a photograph half a million pixels.
std::vector<WeightedPixel> thinned(const std::vector<WeightedPixel>& pixels,
                                   bool keep_weights = false) {
  constexpr std::size_t kEnough = 20'000;
  // Odd, so that a round number of pixels a row does not make columns of it.
  const std::size_t step = pixels.size() / kEnough | 1;
  std::vector<WeightedPixel> some;
  for (std::size_t i = 0; i < pixels.size(); i += step) some.push_back(pixels[i]);
  if (!keep_weights) some.back().weight = some.back().trust;
  return some;
}

// How much a pixel of an open surface's window counts, from where the surface is cut alone.
std::vector<double> trust_of(const Prediction& p, int band) {
  constexpr float kCut = 2, kFull = 8;  // pixels from the cut: nothing is known, all is
  std::vector<double> trust(p.border_px.size());
  if (trust.empty()) return trust;
  const auto beyond =
      grown(p, band, [&](std::size_t i) { return p.coverage[i] > 0 && p.border_px[i] < kCut; });
  for (std::size_t i = 0; i < trust.size(); ++i) {
    const bool skin = p.coverage[i] > 0 && p.border_px[i] >= kCut;
    trust[i] = skin ? std::min(1.0f, p.border_px[i] / kFull) : beyond[i] ? 0 : 1;
  }
  return trust;
}

}  // namespace

std::vector<WeightedPixel> overlap(const PhotoLevel& level, const Prediction& p, int band) {
  std::vector<WeightedPixel> pixels;
  if (p.empty()) return pixels;
  const std::vector<std::uint8_t> mask =
      grown(p, band, [&](std::size_t i) { return p.coverage[i] > 0; });
  const std::vector<double> trust = trust_of(p, band);
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const double known = trust.empty() ? 1 : trust[p.index(x, y)];
      if (mask[p.index(x, y)] && level.valid[level.index(x, y)] && known > 0)
        pixels.push_back({x, y, known, known});
    }
  return pixels;
}

Appearance fit_appearance(const PhotoLevel& level, const Prediction& p, const ShadingBasis& basis,
                          std::vector<WeightedPixel>& pixels) {
  constexpr int kRounds = 4;
  constexpr double kLeastNoise = 2e-3;  // of the luminance range: 8 bits
  constexpr double kInlier = 3;         // standard deviations
  const Fit fit(level, p, basis.size());
  std::vector<WeightedPixel> some = thinned(pixels);
  Appearance appearance;
  VectorXd solution;
  for (int round = 0; round < kRounds; ++round) {
    solution = fit.solve(some);
    std::vector<double> sizes;
    for (const WeightedPixel& pixel : some)
      if (fit.on_organ(pixel)) sizes.push_back(std::abs(fit.residual(pixel, solution)));
    appearance.noise = std::max(kLeastNoise, kSigmaOfMedianDeviation * median(std::move(sizes)));
    weigh(fit, solution, appearance.noise, some);
  }
  weigh(fit, solution, appearance.noise, pixels);
  std::size_t inliers = 0, organ = 0;
  for (const WeightedPixel& pixel : some) {
    if (!fit.on_organ(pixel)) continue;
    ++organ;
    inliers += std::abs(fit.residual(pixel, solution)) < kInlier * appearance.noise;
  }
  appearance.inlier_share = organ > 0 ? static_cast<double>(inliers) / organ : 0;
  const bool lit = basis.size() > 2 || solution[0] > 0;
  appearance.light = lit ? ShadingBasis::Weights::Zero().eval() : basis.first_weights();
  if (lit) appearance.light.head(basis.size()) = solution.head(basis.size());
  appearance.offset = solution[basis.size()];
  return appearance;
}

std::vector<double> held_out_residuals(const PhotoLevel& level, const Prediction& p,
                                       const ShadingBasis& basis,
                                       const std::vector<WeightedPixel>& pixels, int side) {
  const Fit fit(level, p, basis.size());
  const auto is_white = [side](const WeightedPixel& pixel) {
    return (pixel.x / side + pixel.y / side) % 2 == 0;
  };
  std::vector<double> residuals;
  for (const bool white : {true, false}) {
    std::vector<WeightedPixel> fitted;
    std::copy_if(pixels.begin(), pixels.end(), std::back_inserter(fitted),
                 [&](const WeightedPixel& pixel) { return is_white(pixel) == white; });
    const VectorXd solution = fit.solve(thinned(fitted, true));
    for (const WeightedPixel& pixel : pixels)
      if (is_white(pixel) != white && fit.on_organ(pixel))
        residuals.push_back(fit.residual(pixel, solution));
  }
  return residuals;
}

}  // namespace organbake
