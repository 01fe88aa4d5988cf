// SPDX-License-Identifier: GPL-3.0-or-later
// Gradient noise (Perlin 2002) with gradients spread over a cube, the eight corners of a cell as
// plain loops that vectorise. Hashes are of integers only, so that every machine has the same
// tissue.
#include "organbake/capture/solid_noise.h"

#include <cmath>

namespace organbake {
namespace {

// Beyond this many cells the lattice's 32-bit coordinates would wrap; there the noise is zero.
constexpr double kLargestCell = 1e9;

// The eight corners of a cell side by side, in plain arrays and loops over them, so that the
// compiler works on four at a time.
constexpr int kCorners = 8;
using Corners = double[kCorners];
constexpr Corners kUpX = {0, 1, 0, 1, 0, 1, 0, 1};
constexpr Corners kUpY = {0, 0, 1, 1, 0, 0, 1, 1};
constexpr Corners kUpZ = {0, 0, 0, 0, 1, 1, 1, 1};

constexpr std::uint32_t kHashX = 0x8da6b343u, kHashY = 0xd8163841u, kHashZ = 0xcb1ab31fu;
constexpr std::uint32_t kHashStep[kCorners] = {
    0,      kHashX,          kHashY,          kHashX + kHashY,
    kHashZ, kHashX + kHashZ, kHashY + kHashZ, kHashX + kHashY + kHashZ};

struct Cell {
  alignas(32) Corners weight;                     // the product of three fades
  alignas(32) Corners slope_x, slope_y, slope_z;  // its derivatives, per cell
  alignas(32) Corners gradient_x, gradient_y, gradient_z;
  alignas(32) Corners ramp;  // gradient · (point − corner)
};

// 1024 steps a component, uniform in the cube |g_i| < 1: mean square length 1.
double component(std::uint32_t bits) {
  return static_cast<double>(static_cast<std::int32_t>(bits & 1023u)) * (2.0 / 1023.0) - 1.0;
}

void hash_gradients(std::uint32_t corner_hash, Cell& cell) {
  for (int c = 0; c < kCorners; ++c) {
    std::uint32_t h = corner_hash + kHashStep[c];
    h = (h ^ (h >> 16)) * 0x85ebca6bu;  // MurmurHash3's finaliser: neighbours must not look alike
    h = (h ^ (h >> 13)) * 0xc2b2ae35u;
    h ^= h >> 16;
    cell.gradient_x[c] = component(h);
    cell.gradient_y[c] = component(h >> 10);
    cell.gradient_z[c] = component(h >> 20);
  }
}

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double fade_slope(double t) { return 30 * t * t * (t - 1) * (t - 1); }

// False when the point is too far away or not a number.
bool fill(std::uint32_t seed, const Eigen::Vector3d& p, Cell& cell) {
  if (!(std::abs(p.x()) < kLargestCell && std::abs(p.y()) < kLargestCell &&
        std::abs(p.z()) < kLargestCell))
    return false;
  const double x0 = std::floor(p.x()), y0 = std::floor(p.y()), z0 = std::floor(p.z());
  const auto lattice = [](double low) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(low));
  };
  hash_gradients(seed + lattice(x0) * kHashX + lattice(y0) * kHashY + lattice(z0) * kHashZ, cell);

  const double x = p.x() - x0, y = p.y() - y0, z = p.z() - z0;
  const double fx = fade(x), fy = fade(y), fz = fade(z);
  const double sx = fade_slope(x), sy = fade_slope(y), sz = fade_slope(z);
  for (int c = 0; c < kCorners; ++c) {
    const double toward_x = 2 * kUpX[c] - 1, toward_y = 2 * kUpY[c] - 1;
    const double toward_z = 2 * kUpZ[c] - 1;
    const double wx = 1 - kUpX[c] + toward_x * fx, wy = 1 - kUpY[c] + toward_y * fy;
    const double wz = 1 - kUpZ[c] + toward_z * fz;
    cell.weight[c] = wx * wy * wz;
    cell.slope_x[c] = sx * toward_x * wy * wz;
    cell.slope_y[c] = sy * toward_y * wx * wz;
    cell.slope_z[c] = sz * toward_z * wx * wy;
    cell.ramp[c] = cell.gradient_x[c] * (x - kUpX[c]) + cell.gradient_y[c] * (y - kUpY[c]) +
                   cell.gradient_z[c] * (z - kUpZ[c]);
  }
  return true;
}

// Σ a b + c d over the corners: four partial sums, the order that four lanes add in.
double sum_of_products(const Corners& a, const Corners& b, const Corners& c, const Corners& d) {
  double lane[4];
  for (int i = 0; i < 4; ++i)
    lane[i] = a[i] * b[i] + c[i] * d[i] + a[i + 4] * b[i + 4] + c[i + 4] * d[i + 4];
  return (lane[0] + lane[2]) + (lane[1] + lane[3]);
}

double sum_of_products(const Corners& a, const Corners& b) {
  double lane[4];
  for (int i = 0; i < 4; ++i) lane[i] = a[i] * b[i] + a[i + 4] * b[i + 4];
  return (lane[0] + lane[2]) + (lane[1] + lane[3]);
}

}  // namespace

double SolidNoise::value(const Eigen::Vector3d& point_mm) const {
  Cell cell;
  if (!fill(seed_, point_mm * cells_per_mm_, cell)) return 0;
  return sum_of_products(cell.weight, cell.ramp);
}

NoiseSample SolidNoise::sample(const Eigen::Vector3d& point_mm) const {
  Cell cell;
  if (!fill(seed_, point_mm * cells_per_mm_, cell)) return {};
  const Eigen::Vector3d gradient(
      sum_of_products(cell.weight, cell.gradient_x, cell.slope_x, cell.ramp),
      sum_of_products(cell.weight, cell.gradient_y, cell.slope_y, cell.ramp),
      sum_of_products(cell.weight, cell.gradient_z, cell.slope_z, cell.ramp));
  return {sum_of_products(cell.weight, cell.ramp), gradient * cells_per_mm_};
}

}  // namespace organbake
