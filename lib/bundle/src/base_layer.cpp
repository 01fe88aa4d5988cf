// SPDX-License-Identifier: Apache-2.0
// The base layer as the image base.exr and back, and the interpolation between its nodes. The file
// does not say how fine the lattice is; that follows from the number of its columns, and a count
// that no lattice has is refused.
#include "organbake/bundle/base_layer.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// The one row length n gives; solved for n when a file is read.
std::uint32_t steps_from_nodes(int nodes) {
  const auto n = static_cast<std::uint32_t>(std::lround((std::sqrt(8.0 * nodes + 1) - 3) / 2));
  return n >= 1 && (n + 1) * (n + 2) / 2 == static_cast<std::uint32_t>(nodes) ? n : 0;
}

}  // namespace

LatticeMix lattice_mix(std::uint32_t steps, const Eigen::Vector2d& at) {
  const auto n = static_cast<std::int64_t>(steps);
  const double u = std::clamp(at.x(), 0.0, 1.0) * double(n);
  const double v = std::clamp(at.y(), 0.0, 1.0) * double(n);
  const std::int64_t i = std::min<std::int64_t>(static_cast<std::int64_t>(u), n - 1);
  const std::int64_t j = std::min<std::int64_t>(static_cast<std::int64_t>(v), n - 1 - i);
  const auto node = [&](std::int64_t a, std::int64_t b) {
    return base_node_index(steps, std::uint32_t(a), std::uint32_t(b));
  };
  const double s = std::clamp(u - double(i), 0.0, 1.0), t = std::clamp(v - double(j), 0.0, 1.0);
  if (s + t > 1 && i + j + 2 <= n) {
    return {{node(i + 1, j + 1), node(i, j + 1), node(i + 1, j)},
            {float(s + t - 1), float(1 - s), float(1 - t)}};
  }
  const double sum = std::max(1.0, s + t);
  return {{node(i, j), node(i + 1, j), node(i, j + 1)},
          {float(1 - (s + t) / sum), float(s / sum), float(t / sum)}};
}

ChannelImage base_layer_to_image(const BaseLayer& layer) {
  ChannelImage image;
  image.width = static_cast<int>(layer.nodes_per_face());
  image.height = static_cast<int>(layer.face_count);
  std::array<std::vector<float>, 3> rgb;
  for (auto& plane : rgb) plane.reserve(layer.color.size());
  for (const auto& c : layer.color) {
    for (int k = 0; k < 3; ++k) rgb[k].push_back(c[k]);
  }
  image.channels = {{"R", std::move(rgb[0]), true},
                    {"G", std::move(rgb[1]), true},
                    {"B", std::move(rgb[2]), true},
                    {"Y", layer.height_mm, false},
                    {"seen", layer.seen_by, false}};
  return image;
}

BaseLayer base_layer_from_image(const ChannelImage& image, const std::string& name,
                                std::uint32_t face_count) {
  BaseLayer layer;
  layer.steps = steps_from_nodes(image.width);
  layer.face_count = face_count;
  if (layer.steps == 0) {
    throw BadDataError(name + ": " + std::to_string(image.width) +
                       " columns are no triangular lattice");
  }
  if (static_cast<std::uint32_t>(image.height) != face_count) {
    throw BadDataError(name + ": has " + std::to_string(image.height) + " rows for " +
                       std::to_string(face_count) + " proxy faces");
  }
  const auto &r = image.floats("R", name), &g = image.floats("G", name),
             &b = image.floats("B", name);
  layer.height_mm = image.floats("Y", name);
  layer.seen_by = image.uints("seen", name);
  layer.color.reserve(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    layer.color.emplace_back(r[i], g[i], b[i]);
    if (layer.color.back().allFinite() && std::isfinite(layer.height_mm[i])) continue;
    throw BadDataError(name + ": node " + std::to_string(i) + " is not finite");
  }
  return layer;
}

}  // namespace organbake
