// SPDX-License-Identifier: Apache-2.0
// The images that a bundle stores. A virtual camera's maps, in channels that other programs
// understand: depth, colour with coverage, and microstructure with its face and confidence. They
// may come from a stranger: what a renderer would index or divide by is looked at texel by texel.
// The base layer as base.exr and back, and the interpolation between its nodes: the file does not
// say how fine the lattice is; that follows from the number of its columns, and a count that no
// lattice has is refused. A smooth skin as the image of its weights and back: its lattice's number
// of steps is found as the one that gives as many nodes as the image has rows.
#include "organbake/bundle/bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/skin_image.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/smooth_skin.h"

namespace organbake {

CameraMaps background_maps(int width, int height) {
  CameraMaps maps;
  maps.width = width, maps.height = height;
  const std::size_t count = std::size_t(width) * height;
  maps.depth_mm.assign(count, std::numeric_limits<float>::infinity());
  maps.color.assign(count, Eigen::Vector3f::Zero());
  maps.height_mm.assign(count, 0);
  maps.face.assign(count, kNoFace);
  maps.confidence.assign(count, 0);
  return maps;
}

std::string camera_folder(std::size_t camera) { return "cam_" + padded(camera, 3); }

ChannelImage depth_image(const CameraMaps& maps) {
  // The same plane twice: OpenCV 4.6 reads a file with Z alone as zeros, three.js refuses it.
  return {maps.width, maps.height, {{"Y", maps.depth_mm, false}, {"Z", maps.depth_mm, false}}};
}

ChannelImage color_image(const CameraMaps& maps) {
  std::array<std::vector<float>, 4> rgba;
  for (auto& plane : rgba) plane.resize(maps.color.size());
  for (std::size_t i = 0; i < maps.color.size(); ++i) {
    for (int k = 0; k < 3; ++k) rgba[k][i] = maps.color[i][k];
    rgba[3][i] = maps.face[i] == kNoFace ? 0.0f : 1.0f;
  }
  return {maps.width,
          maps.height,
          {{"R", std::move(rgba[0]), true},
           {"G", std::move(rgba[1]), true},
           {"B", std::move(rgba[2]), true},
           {"A", std::move(rgba[3]), true}}};
}

ChannelImage micro_image(const CameraMaps& maps) {
  return {maps.width,
          maps.height,
          {{"Y", maps.height_mm, false},
           {"face", maps.face, false},
           {"confidence", maps.confidence, true}}};
}

void check_maps(const CameraMaps& maps, std::size_t faces, const std::string& folder) {
  const auto fail = [&](std::size_t i, const char* file, const char* what) {
    throw BadDataError(folder + "/" + file + ": texel (" + std::to_string(i % maps.width) + ", " +
                       std::to_string(i / maps.width) + ") " + what);
  };
  // All of them, several at a time, before the wrong one is looked for.
  constexpr float kMost = std::numeric_limits<float>::max();
  const auto named = static_cast<std::uint32_t>(std::min<std::size_t>(faces, kNoFace));
  int wrong = 0;
  const std::size_t texels = maps.face.size();
  constexpr std::size_t kOnce = 64;
  for (std::size_t first = 0; first < texels; first += kOnce) {
    const std::size_t end = std::min(first + kOnce, texels);
    std::uint32_t all = kNoFace;
    for (std::size_t i = first; i < end; ++i) all &= maps.face[i];
    if (all == kNoFace) continue;
    for (std::size_t i = first; i < end; ++i) {
      const Eigen::Vector3f& c = maps.color[i];
      const bool right = (maps.face[i] < named) & (maps.depth_mm[i] > 0) &
                         (maps.depth_mm[i] <= kMost) & (std::abs(maps.height_mm[i]) <= kMost) &
                         (maps.confidence[i] >= 0) & (maps.confidence[i] <= 1) &
                         (std::abs(c[0]) <= kMost) & (std::abs(c[1]) <= kMost) &
                         (std::abs(c[2]) <= kMost);
      wrong |= !right & (maps.face[i] != kNoFace);
    }
  }
  for (std::size_t i = 0; wrong && i < maps.face.size(); ++i) {
    if (maps.face[i] == kNoFace) continue;
    if (maps.face[i] >= faces) fail(i, "micro.exr", "names a face that the bundle does not have");
    if (!(maps.depth_mm[i] > 0) || !std::isfinite(maps.depth_mm[i])) {
      fail(i, "depth.exr", "has no finite positive depth");
    }
    if (!std::isfinite(maps.height_mm[i])) fail(i, "micro.exr", "has no finite height");
    if (!(maps.confidence[i] >= 0 && maps.confidence[i] <= 1)) {
      fail(i, "micro.exr", "has a confidence outside 0…1");
    }
    if (!maps.color[i].allFinite()) fail(i, "color.exr", "is not finite");
  }
}

std::vector<Eigen::Vector3f> colors_from_image(const ChannelImage& image, const std::string& name) {
  const float *const r = image.floats("R", name).data(), *const g = image.floats("G", name).data(),
                     *const b = image.floats("B", name).data();
  std::vector<Eigen::Vector3f> colors(image.pixel_count());
  for (std::size_t i = 0; i < colors.size(); ++i) colors[i] = {r[i], g[i], b[i]};
  return colors;
}

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
  layer.height_mm = image.floats("Y", name);
  layer.seen_by = image.uints("seen", name);
  layer.color = colors_from_image(image, name);
  for (std::size_t i = 0; i < layer.color.size(); ++i) {
    if (layer.color[i].allFinite() && std::isfinite(layer.height_mm[i])) continue;
    throw BadDataError(name + ": node " + std::to_string(i) + " is not finite");
  }
  return layer;
}

namespace {

constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;
constexpr std::uint32_t kMostSteps = 64;  // lattice_steps never takes more

// More steps have more nodes: at most one number of steps fits. With two steps each edge has one
// node between its ends.
std::uint32_t steps_with(std::uint32_t nodes, const TriangleMesh& proxy) {
  const auto vertices = proxy.vertices.size(), edges = Lattice(proxy, 2).node_count() - vertices;
  for (std::uint32_t inner = 0; inner < kMostSteps; ++inner) {
    const std::size_t in_face = inner * (inner - 1) / 2;
    if (vertices + inner * edges + in_face * proxy.faces.size() == nodes) return inner + 1;
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
