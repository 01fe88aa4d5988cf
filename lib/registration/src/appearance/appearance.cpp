// SPDX-License-Identifier: GPL-3.0-or-later
// The light in a photograph: shading as a weighted sum of basis functions, of a lamp at the camera,
// spherical harmonics of unknown distant light (Ramamoorthi & Hanrahan 2001), and a beam to first
// order. Being linear, the light is solved for at every pose and never searched.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>

#include "cost_functions/cost_functions.h"
#include "organbake/core/quantile.h"
#include "organbake/geometry/dense_solve.h"
#include "organbake/registration/register_photo.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

int size_of(LightModel model) {
  switch (model) {
    case LightModel::estimated:
      return ShadingBasis::kMost;
    case LightModel::beam:
      return 8;
    default:
      return 2;
  }
}

// How a beam's strength varies over the picture and with the distance, and its slope by the point.
struct Beam {
  double u, v, u2_v2, log_r;

  Beam(const Vector3d& x, double reference_mm)
      : u(x.x() / x.z()),
        v(x.y() / x.z()),
        u2_v2(u * u + v * v),
        log_r(std::log(x.norm() / reference_mm)) {}
  double sum(const ShadingBasis::Weights& w) const {
    return w[0] + w[1] * u + w[2] * v + w[3] * u2_v2 + w[4] * log_r;
  }
  Vector3d slope(const Vector3d& x, const ShadingBasis::Weights& w) const {
    const double by_u = w[1] + 2 * w[3] * u, by_v = w[2] + 2 * w[3] * v;
    return Vector3d(by_u, by_v, -by_u * u - by_v * v) / x.z() + w[4] / x.squaredNorm() * x;
  }
};

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The mask of those of the window's pixels that are `in`, grown by `band` pixels, rows and columns
// apart.
template <class In>
std::vector<std::uint8_t> grown(const Prediction& p, int band, const In& in) {
  std::vector<std::uint8_t> mask(p.coverage.size());
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = in(i);
  const cv::Mat view(p.height, p.width, CV_8U, mask.data());
  const cv::Size square(2 * band + 1, 2 * band + 1);
  cv::dilate(view, view, cv::getStructuringElement(cv::MORPH_RECT, square));
  return mask;
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

const char* name_of(LightModel model) {
  switch (model) {
    case LightModel::automatic:
      return "auto";
    case LightModel::camera:
      return "camera";
    case LightModel::beam:
      return "beam";
    default:
      return "estimated";
  }
}

ShadingBasis::ShadingBasis(LightModel light, double reference_mm)
    : light_(light),
      reference2_(reference_mm * reference_mm),
      reference_mm_(reference_mm),
      size_(size_of(light)) {}

ShadingBasis::Weights ShadingBasis::first_weights() const {
  Weights weights = Weights::Zero();
  weights[0] = 1;
  return weights;
}

void ShadingBasis::values(const Vector3d& x, const Vector3d& n, double* phi) const {
  phi[size_ - 1] = 0;
  const double r2 = x.squaredNorm();
  phi[0] = std::max(0.0, -n.dot(x)) * reference2_ / (r2 * std::sqrt(r2));
  if (light_ == LightModel::beam) {
    const Beam beam(x, reference_mm_);
    phi[1] = phi[0] * beam.u;
    phi[2] = phi[0] * beam.v;
    phi[3] = phi[0] * beam.u2_v2;
    phi[4] = phi[0] * beam.log_r;
    // Of n · d / |d|³ by the lamp's place, d from the point to the lamp.
    const double by_n = reference2_ * reference_mm_ / (r2 * std::sqrt(r2));
    const double by_x = -3 * n.dot(x) / r2;
    phi[5] = by_n * (n.x() + by_x * x.x());
    phi[6] = by_n * (n.y() + by_x * x.y());
  }
  if (light_ != LightModel::estimated) return;
  phi[1] = n.x();
  phi[2] = n.y();
  phi[3] = n.z();
  phi[4] = n.x() * n.y();
  phi[5] = n.y() * n.z();
  phi[6] = n.x() * n.z();
  phi[7] = n.x() * n.x() - n.y() * n.y();
  phi[8] = 3 * n.z() * n.z() - 1;
}

ShadingBasis::Gradient ShadingBasis::gradient(const Vector3d& x, const Vector3d& n,
                                              const Weights& w) const {
  Gradient g;
  const double facing = -n.dot(x), r2 = x.squaredNorm();
  const bool shaped = light_ == LightModel::beam;
  const double lamp = reference2_ / (r2 * std::sqrt(r2));
  if (facing > 0) {
    const Beam beam(x, reference_mm_);
    const double scale = (shaped ? beam.sum(w) : w[0]) * lamp;
    g.by_point = -scale * (n + 3 * facing / r2 * x);
    g.by_normal = -scale * x;
    if (shaped) g.by_point += lamp * facing * beam.slope(x, w);
  }
  if (shaped) {
    const Vector3d place(w[5], w[6], 0);  // of the lamp, weighted
    const double scale = lamp * reference_mm_, aside = place.dot(x) / r2;
    g.by_normal += scale * (place - 3 * aside * x);
    g.by_point +=
        3 * scale / r2 * (-n.dot(place) * x - aside * r2 * n + n.dot(x) * (5 * aside * x - place));
  }
  if (light_ != LightModel::estimated) return g;
  g.by_normal += Vector3d(w[1] + w[4] * n.y() + w[6] * n.z() + 2 * w[7] * n.x(),
                          w[2] + w[4] * n.x() + w[5] * n.z() - 2 * w[7] * n.y(),
                          w[3] + w[5] * n.y() + w[6] * n.x() + 6 * w[8] * n.z());
  return g;
}

// The light that explains a photograph best at a pose, by robust least squares (Geman & McClure
// 1987), and which pixels take part. The overlap is fixed while a solver runs: otherwise it could
// raise the correlation by showing less.

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
