// SPDX-License-Identifier: GPL-3.0-or-later
// What makes surfaces smooth: a separable Gaussian on the values before they are contoured, an axis
// after the other. Rows that lie side by side are worked on together, so that memory is read in its
// order for every axis.
#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/core/parallel.h"
#include "surface_steps.h"

namespace organbake {
namespace {

// Half of a symmetric kernel, from the centre outwards; each weight is the Gaussian's share of the
// voxel, so that a σ below one voxel still blurs by σ.
std::vector<float> half_kernel(double sigma) {
  const int reach = gaussian_reach(sigma);
  std::vector<double> weights;
  double sum = 0;
  const double scale = 1 / (std::sqrt(2.0) * sigma);
  for (int i = 0; i <= reach; ++i) {
    weights.push_back(0.5 * (std::erf((i + 0.5) * scale) - std::erf((i - 0.5) * scale)));
    sum += i == 0 ? weights.back() : 2 * weights.back();
  }
  std::vector<float> kernel;
  for (const double w : weights) kernel.push_back(static_cast<float>(w / sum));
  return kernel;
}

// Blurs `count` rows of `width` values that lie `stride` apart, across the rows. The inner loop
// runs over neighbouring values, so it vectorises for every axis but x.
void blur_across(const float* in, float* out, int count, std::size_t stride, int width,
                 const std::vector<float>& kernel) {
  const int reach = static_cast<int>(kernel.size()) - 1;
  for (int row = 0; row < count; ++row) {
    float* to = out + row * stride;
    const float* centre = in + row * stride;
    for (int x = 0; x < width; ++x) to[x] = kernel[0] * centre[x];
    for (int r = 1; r <= reach; ++r) {
      const float* before = in + std::max(row - r, 0) * stride;
      const float* after = in + std::min(row + r, count - 1) * stride;
      for (int x = 0; x < width; ++x) to[x] += kernel[r] * (before[x] + after[x]);
    }
  }
}

void blur_row(const float* in, float* out, int width, const std::vector<float>& kernel,
              std::vector<float>& padded) {
  const int reach = static_cast<int>(kernel.size()) - 1;
  padded.resize(static_cast<std::size_t>(width + 2 * reach));
  std::fill_n(padded.begin(), reach, in[0]);
  std::copy_n(in, width, padded.begin() + reach);
  std::fill_n(padded.begin() + reach + width, reach, in[width - 1]);
  const float* centre = padded.data() + reach;
  for (int x = 0; x < width; ++x) out[x] = kernel[0] * centre[x];
  for (int r = 1; r <= reach; ++r)
    for (int x = 0; x < width; ++x) out[x] += kernel[r] * (centre[x - r] + centre[x + r]);
}

}  // namespace

int gaussian_reach(double sigma_voxels) {
  return sigma_voxels > 0 ? static_cast<int>(std::ceil(3 * sigma_voxels)) : 0;
}

void gaussian_blur(std::vector<float>& values, const std::array<int, 3>& size,
                   const Eigen::Vector3d& sigma_voxels) {
  const auto [nx, ny, nz] = size;
  const std::size_t slice = static_cast<std::size_t>(nx) * ny;
  std::vector<float> other(values.size());
  for (int axis = 0; axis < 3; ++axis) {
    if (!(sigma_voxels[axis] > 0)) continue;
    const std::vector<float> kernel = half_kernel(sigma_voxels[axis]);
    if (axis == 2) {
      parallel_for(0, ny, [&](int j) {
        const std::size_t row = std::size_t(j) * nx;
        blur_across(&values[row], &other[row], nz, slice, nx, kernel);
      });
    } else {
      parallel_for(0, nz, [&](int k) {
        if (axis == 1) {
          blur_across(&values[k * slice], &other[k * slice], ny, std::size_t(nx), nx, kernel);
          return;
        }
        std::vector<float> padded;
        for (std::size_t row = k * slice; row < (k + 1) * slice; row += std::size_t(nx))
          blur_row(&values[row], &other[row], nx, kernel, padded);
      });
    }
    values.swap(other);
  }
}

}  // namespace organbake
