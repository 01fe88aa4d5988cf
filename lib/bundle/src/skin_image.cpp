// SPDX-License-Identifier: Apache-2.0
// A smooth skin as the image of its weights and back. The lattice's number of steps is not stored:
// it is found as the one that gives as many nodes as the image has rows.
#include "organbake/bundle/skin_image.h"

#include <algorithm>

#include "organbake/core/error.h"
#include "organbake/geometry/smooth_skin.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;
constexpr std::uint32_t kMostSteps = 64;  // lattice_steps never takes more

// More steps have more nodes: at most one number of steps fits.
std::uint32_t steps_with(std::uint32_t nodes, const TriangleMesh& proxy) {
  for (std::uint32_t steps = 1; steps <= kMostSteps; ++steps) {
    if (Lattice(proxy, steps).node_count() == nodes) return steps;
  }
  return 0;
}

}  // namespace

ChannelImage skin_to_image(const SmoothSkin& skin) {
  std::uint32_t most = 1;
  for (std::size_t n = 0; n < skin.node_count(); ++n)
    most = std::max(most, skin.first[n + 1] - skin.first[n]);
  ChannelImage image;
  image.width = static_cast<int>(most);
  image.height = static_cast<int>(skin.node_count());
  std::vector<std::uint32_t> vertex(image.pixel_count(), kNoVertex);
  std::vector<float> weight(image.pixel_count(), 0.0f);
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k) {
      const std::size_t at = n * most + (k - skin.first[n]);
      vertex[at] = skin.carrier[k];
      weight[at] = static_cast<float>(skin.weight[k]);
    }
  }
  image.channels = {{"vertex", std::move(vertex), false}, {"weight", std::move(weight), false}};
  return image;
}

SmoothSkin skin_from_image(const ChannelImage& image, const std::string& name,
                           const TriangleMesh& proxy) {
  const auto& vertex = image.uints("vertex", name);
  const auto& weight = image.floats("weight", name);
  SmoothSkin skin;
  skin.steps = steps_with(static_cast<std::uint32_t>(image.height), proxy);
  if (skin.steps == 0) {
    throw BadDataError(name + ": " + std::to_string(image.height) +
                       " rows are no lattice over this proxy");
  }
  skin.first.push_back(0);
  for (std::size_t i = 0; i < vertex.size(); ++i) {
    if (vertex[i] != kNoVertex) {
      skin.carrier.push_back(vertex[i]);
      skin.weight.push_back(weight[i]);
    }
    if ((i + 1) % image.width == 0)
      skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  check_smooth_skin(skin, proxy, name);
  complete_weights(skin);
  return skin;
}

}  // namespace organbake
