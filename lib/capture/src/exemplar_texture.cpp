// SPDX-License-Identifier: GPL-3.0-or-later
// The exemplar on a surface: a triangle grid of cells on three planes (Burley 2019; planes blended
// by the normal), each cell from a place of its own by a hash. Blended channels are matched to the
// tissue's quantiles.
#include "coloring.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

std::uint32_t hashed(std::int64_t i, std::int64_t j, int plane) {
  auto h = static_cast<std::uint32_t>(i) * 0x8da6b343u ^
           static_cast<std::uint32_t>(j) * 0xd8163841u ^
           static_cast<std::uint32_t>(plane + 1) * 0xcb1ab31fu;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;  // MurmurHash3's finaliser
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

}  // namespace

// A cell's points lie up to one side from its vertex.
ExemplarTexture::ExemplarTexture(Exemplar exemplar)
    : exemplar_(std::move(exemplar)), side_mm_(exemplar_.reach_mm()) {
  match_channels();
}

// Principal components are uncorrelated, but seldom independent: what is blended of them has
// channels of a little other values than the tissue has. Their quantiles, over many points of a
// plane, tell by how much.
void ExemplarTexture::match_channels() {
  constexpr int kSide = 192;
  constexpr double kStep = 0.37;  // of a cell: 71 cells to each side, at ever other places in them
  std::vector<Vector3f> blended;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      blended.push_back(blended_at(kStep * side_mm_ * Vector3d(x, y, 0), Vector3d::UnitZ()));
  for (int c = 0; c < 3; ++c) {
    const auto quantiles = [&](const std::vector<Vector3f>& colors) {
      std::vector<float> values;
      for (const Vector3f& color : colors) values.push_back(color[c]);
      std::sort(values.begin(), values.end());
      std::array<float, kQuantiles + 1> found;
      for (std::size_t k = 0; k <= kQuantiles; ++k)
        found[k] = values[k * (values.size() - 1) / kQuantiles];
      return found;
    };
    blended_[c] = quantiles(blended), wanted_[c] = quantiles(exemplar_.tissue());
  }
}

void ExemplarTexture::add_plane(int plane, const Vector2d& at_mm, double weight, Vector3f& sum,
                                double& squares) const {
  // Skewed so that the triangles of the grid are halves of unit squares.
  const double v = at_mm.y() / (side_mm_ * std::sqrt(0.75)), u = at_mm.x() / side_mm_ - 0.5 * v;
  const double i = std::floor(u), j = std::floor(v), a = u - i, b = v - j;
  const bool upper = a + b > 1;
  const std::array<Vector2d, 3> corners = {upper ? Vector2d(i + 1, j + 1) : Vector2d(i, j),
                                           Vector2d(i + 1, j), Vector2d(i, j + 1)};
  const std::array<double, 3> shares = {upper ? a + b - 1 : 1 - a - b, upper ? 1 - b : a,
                                        upper ? 1 - a : b};
  double own = 0;
  for (const double share : shares) own += share * share * share * share;
  for (int k = 0; k < 3; ++k) {
    const Vector2d& corner = corners[k];
    const Vector2d vertex_mm =
        side_mm_ * Vector2d(corner.x() + 0.5 * corner.y(), std::sqrt(0.75) * corner.y());
    const std::uint32_t hash =
        hashed(static_cast<std::int64_t>(corner.x()), static_cast<std::int64_t>(corner.y()), plane);
    // Mirrored and turned by quarters: eight pieces from each place.
    Vector2d off = at_mm - vertex_mm;
    if (hash & 1u) off.x() = -off.x();
    if (hash & 2u) off.y() = -off.y();
    if (hash & 4u) std::swap(off.x(), off.y());
    const std::size_t place = (hash >> 3) % exemplar_.place_count();
    const double w = weight * shares[k] * shares[k] / std::sqrt(own);
    sum += static_cast<float>(w) * exemplar_.scores(place, off);
  }
  squares += weight * weight;
}

Vector3f ExemplarTexture::blended_at(const Vector3d& point, const Vector3d& normal) const {
  constexpr double kUnseen = 0.25;  // planes nearer to edge-on add nothing
  Vector3f sum = Vector3f::Zero();
  double squares = 0;
  for (int plane = 0; plane < 3; ++plane) {
    const double facing = std::max(0.0, std::abs(normal[plane]) - kUnseen);
    if (!(facing > 0)) continue;
    const Vector2d at_mm(point[(plane + 1) % 3], point[(plane + 2) % 3]);
    add_plane(plane, at_mm, facing * facing * facing, sum, squares);
  }
  return exemplar_.color(sum / static_cast<float>(std::sqrt(squares)));
}

Vector3f ExemplarTexture::at(const Vector3d& point, const Vector3d& normal) const {
  Vector3f color = blended_at(point, normal);
  for (int c = 0; c < 3; ++c) {
    const auto& from = blended_[c];
    const auto& to = wanted_[c];
    const auto above = std::upper_bound(from.begin() + 1, from.end() - 1, color[c]);
    const auto k = static_cast<std::size_t>(above - from.begin());
    const float width = from[k] - from[k - 1];
    const float share = width > 0 ? std::clamp((color[c] - from[k - 1]) / width, 0.0f, 1.0f) : 0.5f;
    color[c] = to[k - 1] + share * (to[k] - to[k - 1]);
  }
  return color;
}

}  // namespace organbake
