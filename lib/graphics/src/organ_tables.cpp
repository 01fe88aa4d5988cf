// SPDX-License-Identifier: Apache-2.0
// Packs an organ's samples, nodes and faces into the textures that the shaders read: all of it
// once, and after each cut, and in each pose the shell.
#include "organ_passes.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

std::uint32_t bits_of(float value) { return __builtin_bit_cast(std::uint32_t, value); }

std::uint32_t two_words(std::int32_t low, std::int32_t high) {
  return (static_cast<std::uint32_t>(low) & 0xFFFFu) | static_cast<std::uint32_t>(high) << 16;
}

// A direction on an octahedron's unfolded sides (Meyer et al. 2010, "On floating-point normal
// vectors"), two signed bytes pairs.
std::uint32_t octahedral(const Eigen::Vector3f& normal) {
  Eigen::Vector3f n = normal / std::max(1e-20f, normal.cwiseAbs().sum());
  if (n.z() < 0) {
    const Eigen::Vector2f turned(1 - std::abs(n.y()), 1 - std::abs(n.x()));
    n.head<2>() << std::copysign(turned.x(), n.x()), std::copysign(turned.y(), n.y());
  }
  const auto word = [](float v) { return static_cast<std::int32_t>(std::floor(32767 * v + 0.5f)); };
  return two_words(word(n.x()), word(n.y()));
}

std::uint32_t root_of(float light) {
  const double root = std::sqrt(std::max(0.0, double(light))) / kColorRoot;
  return static_cast<std::uint32_t>(65535 * std::min(1.0, root) + 0.5);
}

}  // namespace

void SampleTable::take(const SampleSet& source) {
  const std::size_t slots = kChunk * source.chunks.size();
  first_color = static_cast<int>(slots / 2), first_patch = 3 * first_color;
  patches = static_cast<int>(source.chunks.size());
  texel_mm = source.texel_mm;
  table.reserve(first_patch + 4 * source.chunks.size());
  std::vector<std::uint32_t> words(2 * slots);
  for (std::size_t i = 0; i < slots; ++i) {
    const bool used = i % kChunk < source.chunks[i / kChunk].count;
    words[2 * i] = two_words(source.b1[i], source.b2[i]);
    words[2 * i + 1] = two_words(source.h[i], used);
  }
  table.put(0, words);
  table.put(first_color, source.colors);
  words.clear();
  for (const auto& [patch, count] : source.chunks) {
    for (const auto* three : {&patch.center, &patch.extent, &patch.along_u, &patch.along_v})
      for (const float number : *three) words.push_back(bits_of(number));
    words.insert(words.end(),
                 {bits_of(patch.cone.sine), bits_of(patch.cone.cosine), patch.face, 0});
  }
  table.put(first_patch, words);
}

// Each node: height, seen by, normal, red and green; place at rest, blue and bend. Apart, each
// face's knots.
void OrganTables::take_nodes(const OrganSource& source) {
  const BaseLayer& base = source.base;
  const bool lit = source.lighting != nullptr;
  first_knot_ = static_cast<int>(2 * base.height_mm.size());
  knots_ = source.knots;
  std::vector<std::array<std::uint32_t, 4>> texels(first_knot_ + 2 * source.knots_of_face.size());
  for (std::size_t f = 0; f < base.face_count; ++f) {
    each_node(base.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const std::size_t at = f * base.nodes_per_face() + node;
      const Eigen::Vector3f& color = base.color[at];
      Eigen::Vector3f place = Eigen::Vector3f::Zero();
      std::uint32_t bend = 0;
      if (!source.bends.empty())
        bend = static_cast<std::uint32_t>(65535 * std::min(1.0, source.bends[at] / kSharpestBend));
      if (lit)
        place = shell_point(source.rest_shells[f], double(i) / base.steps, double(j) / base.steps,
                            base.height_mm[at])
                    .cast<float>();
      texels[2 * at] = {bits_of(base.height_mm[at]), base.seen_by[at],
                        lit ? octahedral(source.rest_normals[at]) : 0,
                        root_of(color[0]) | root_of(color[1]) << 16};
      texels[2 * at + 1] = {bits_of(place.x()), bits_of(place.y()), bits_of(place.z()),
                            root_of(color[2]) | bend << 16};
    });
  }
  auto knots_at = texels.begin() + first_knot_;
  for (const auto& k : source.knots_of_face) {
    *knots_at++ = {k[0], k[1], k[2], k[3]};
    *knots_at++ = {k[4], k[5], 0, 0};
  }
  nodes_.fill(texels);
}

void OrganTables::pose(const OrganSource& source, const std::vector<Eigen::Vector3d>& positions,
                       bool lit) {
  ++picture_;
  const bool moved = id_ != source.id || pose_ != source.pose;
  if (id_ != source.id) {
    id_ = source.id;
    origin = source.at_rest.center();
    steps = source.base.face_count > 0 ? static_cast<int>(source.base.steps) : 0;
    faces = static_cast<int>(source.shells.size());
    take_nodes(source);
  }
  if (moved) {
    posed_ = positions;
    pose_ = source.pose;
    turned_ = false;
    // Seven texels a face: its matrix column by column, and whether both sides are skin.
    shell_texels_.resize(source.shells.size());
    for (std::size_t f = 0; f < source.shells.size(); ++f) {
      const ShellMatrix& shell = source.shells[f];
      Eigen::Map<Eigen::Matrix<float, 3, 9>> columns(shell_texels_[f].data());
      columns = shell.cast<float>();
      columns.col(0) = (shell.col(0) - origin).cast<float>();
      shell_texels_[f](3, 6) = source.two_sided[f];
    }
    shells_.fill(shell_texels_);
  }
  if (!lit || turned_) return;
  turns_.fill(source.turns);
  turned_ = true;
}

const SampleTable& OrganTables::samples(Warper& warper, std::size_t camera) {
  Camera& one = cameras_[camera];
  one.used_in = picture_;
  if (one.of == id_) return one.samples;
  one.samples.take(warper.samples(camera));
  one.of = id_;
  // Others make room, those first that no view has asked for the longest.
  while (bytes() > kept_bytes_) {
    const auto oldest = std::min_element(
        cameras_.begin(), cameras_.end(),
        [](const auto& a, const auto& b) { return a.second.used_in < b.second.used_in; });
    if (oldest->second.used_in == picture_) break;
    cameras_.erase(oldest);
  }
  return one.samples;
}

void OrganTables::bind(const Program& program) const {
  program.set_texture("shells", GL_TEXTURE_2D, shells_.texture());
  program.set_texture("nodes", GL_TEXTURE_2D, nodes_.texture());
  program.set_texture("turns", GL_TEXTURE_2D, turns_.texture());
  program.set("steps", steps);
  program.set("knots", knots_);
  program.set("first_knot", first_knot_);
}

std::size_t OrganTables::bytes() const {
  std::size_t sum = 0;
  for (const auto& [camera, one] : cameras_) sum += one.samples.table.bytes();
  return sum;
}

}  // namespace organbake
