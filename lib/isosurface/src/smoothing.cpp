// SPDX-License-Identifier: GPL-3.0-or-later
// What makes surfaces smooth: a separable Gaussian on the values before they are contoured, and
// umbrella steps on the mesh behind it (Taubin 1995).
#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/core/parallel.h"
#include "surface_steps.h"

namespace organbake {
namespace {

// Separable Gaussian blur, an axis after the other. Rows that lie side by side are worked on
// together, so that memory is read in its order for every axis.

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

// Smoothing without shrinking by alternate umbrella steps of opposite sign (Taubin 1995). The
// little volume that is lost all the same is given back along the normals, because an organ's
// volume is what people measure of it.
namespace {

// Pass band 1/λ + 1/μ = 0.1, as Taubin proposes.
constexpr double kShrink = 0.5;
constexpr double kGrow = -0.526315789;
constexpr double kVolumeTolerance = 1e-4;
constexpr int kMostOffsets = 4;

// The neighbours of every vertex, one after the other.
struct Neighbours {
  std::vector<std::uint32_t> first;  // of vertex v: [first[v], first[v + 1])
  std::vector<std::uint32_t> vertex;
  std::vector<bool> fixed;  // on a boundary
  bool closed = true;
};

// In a closed mesh every neighbour follows the vertex in exactly one face; the successors alone are
// all neighbours. A vertex whose successors and predecessors differ lies on a boundary.
Neighbours neighbours_of(const TriangleMesh& mesh) {
  Neighbours around;
  const std::size_t count = mesh.vertices.size();
  around.first.assign(count + 1, 0);
  around.fixed.assign(count, false);
  for (const Face& face : mesh.faces)
    for (const std::uint32_t corner : face) ++around.first[corner + 1];
  for (std::size_t v = 0; v < count; ++v) around.first[v + 1] += around.first[v];
  around.vertex.resize(around.first.back());
  std::vector<std::uint32_t> at(around.first.begin(), around.first.end() - 1);
  std::vector<std::uint64_t> balance(count, 0);  // successors − predecessors, as a sum of hashes
  const auto hash = [](std::uint64_t x) { return (x + 1) * 0x9E3779B97F4A7C15u; };
  for (const Face& face : mesh.faces) {
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t here = face[c], next = face[(c + 1) % 3], last = face[(c + 2) % 3];
      around.vertex[at[here]++] = next;
      balance[here] += hash(next) - hash(last);
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    if (balance[v] == 0) continue;
    around.fixed[v] = true;
    around.closed = false;
  }
  return around;
}

void umbrella_step(const std::vector<Eigen::Vector3d>& from, const Neighbours& around, double share,
                   std::vector<Eigen::Vector3d>& to) {
  parallel_for(std::size_t{0}, from.size(), [&](std::size_t v) {
    const std::uint32_t begin = around.first[v], end = around.first[v + 1];
    to[v] = from[v];
    if (begin == end || around.fixed[v]) return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::uint32_t n = begin; n < end; ++n) sum += from[around.vertex[n]];
    to[v] += share * (sum / (end - begin) - from[v]);
  });
}

// Moving every vertex along its normal by d changes the volume by d times the area.
void give_volume_back(TriangleMesh& mesh, double volume) {
  for (int step = 0; step < kMostOffsets; ++step) {
    const double missing = volume - signed_volume(mesh);
    if (std::abs(missing) <= kVolumeTolerance * std::abs(volume)) return;
    const double offset = missing / surface_area(mesh);
    const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
    for (std::size_t v = 0; v < normals.size(); ++v) mesh.vertices[v] += offset * normals[v];
  }
}

}  // namespace

void taubin_smooth(TriangleMesh& mesh, int steps, const RunContext& context) {
  if (steps <= 0 || mesh.empty()) return;
  const Neighbours around = neighbours_of(mesh);
  const double volume = signed_volume(mesh);
  std::vector<Eigen::Vector3d> other(mesh.vertices.size());
  for (int step = 0; step < steps; ++step) {
    context.throw_if_cancelled();
    umbrella_step(mesh.vertices, around, kShrink, other);
    umbrella_step(other, around, kGrow, mesh.vertices);
  }
  if (around.closed) give_volume_back(mesh, volume);
}

}  // namespace organbake
