// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/error.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/warp/warper.h"

// What another way of drawing, such as graphics hardware, needs to know of a Warper's organ. All
// spans and pointers lead into the Warper, and hold until its next pose, draw or end.
namespace organbake {

// How far normals lean from a middle one. They lean a little more once their face bends.
struct NormalCone {
  float sine = 0, cosine = 1;  // of the widest angle

  NormalCone() = default;
  explicit NormalCone(float widest_rad) {
    constexpr float kBend_rad = 0.15f;
    const float angle = std::min(widest_rad + kBend_rad, std::numbers::pi_v<float>);
    sine = std::sin(angle), cosine = std::cos(angle);
  }
};

// A small piece of one camera's map over one proxy face, described in the face's shell coordinates
// (b1, b2, h): enough to place, measure and cull it under any deformation without its samples.
struct Patch {
  std::uint32_t face = 0;
  float center[3] = {};   // b1, b2, h
  float extent[3] = {};   // half sizes about the centre
  float along_u[3] = {};  // change of (b1, b2, h) per texel column …
  float along_v[3] = {};  // … and per row
  NormalCone cone;        // of the samples' normals, about the patch's
};

// Patches as structure of arrays: a camera has tens of thousands, and each is placed in every
// frame.
class PatchTable {
 public:
  // What a patch is but for its face: center, extent, along_u, along_v, the cone's sine and cosine.
  static constexpr int kNumbers = 14;
  std::uint32_t face(std::size_t patch) const { return faces_[patch]; }

  PatchTable() = default;
  explicit PatchTable(std::span<const Patch> patches);
  // One number of each patch; beyond the last, whole vectors can be read.
  const float* number(int k) const { return numbers_[k].data(); }

 private:
  std::vector<std::uint32_t> faces_;
  std::array<std::vector<float>, kNumbers> numbers_;
};

// What a texel's pixels show, each where it looks: at each corner of the texel what the texels that
// meet there on the same surface come to, bilinear between them, and the texel's own colour in its
// middle. So colours run on over its borders. In square-root light (255·√linear): as fine as sRGB
// in 8 bits, and squaring makes it linear. Word k: red, green and blue of corner k (u₀v₀, u₁v₀,
// u₀v₁, u₁v₁), and in the highest byte the texel's own red, green, blue and confidence (255 = 1).
struct TexelColors : std::array<std::uint32_t, 4> {
  // Any, as slots without a sample have: vectors of megabytes are not filled with zeros before.
  TexelColors() {}  // NOLINT
  TexelColors(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3)
      : array{c0, c1, c2, c3} {}
};
// The texel's own.
inline std::uint32_t own_byte(const TexelColors& texel, int k) { return texel[k] >> 24; }

// Where samples lie within their patch: center + extent × coordinate / kFullCoordinate, each
// coordinate of a sample in two bytes. A ten-thousandth of a texel is lost.
using PatchCoordinate = std::int16_t;
inline constexpr float kFullCoordinate = 32767;

// Samples come in chunks of at most kChunk, each of one patch; chunk c owns the slots from
// kChunk·c on, so that a slot number alone finds its chunk. Slots without a sample lie at the
// patch's middle: whole chunks are placed.
inline constexpr std::uint32_t kChunk = 64;

struct Chunk {
  Patch patch;
  std::uint32_t count = 0;  // samples in use, ≥ 1
};

// What one camera contributes: structure of arrays over slots, chunks sorted by face and then by
// map neighbourhood.
struct SampleSet {
  std::vector<PatchCoordinate> b1, b2, h;
  std::vector<TexelColors> colors;
  std::vector<Chunk> chunks;
  PatchTable patches;  // the chunks', once more
  std::size_t sample_count = 0;
  double texel_mm = 0;  // mean size of a texel on the surface, facing the camera

  std::uint32_t face(std::size_t slot) const { return chunks[slot / kChunk].patch.face; }
  // (b1, b2, h) of one sample.
  std::array<float, 3> bound(std::size_t slot) const {
    const Patch& patch = chunks[slot / kChunk].patch;
    return {at(patch, 0, b1[slot]), at(patch, 1, b2[slot]), at(patch, 2, h[slot])};
  }

  // b1, b2, h of up to a chunk's samples, axis by axis.
  using Bound = std::array<std::array<float, kChunk>, 3>;
  // Bounds `count` samples, ≥ 1, by a patch, and keeps where they lie within it, from a slot on.
  void put(const Bound& bound, std::uint32_t count, std::size_t first_slot, Patch& patch);
  // Makes `patches` those of the chunks.
  void copy_patches();

 private:
  static float at(const Patch& patch, int axis, PatchCoordinate at) {
    return patch.center[axis] + patch.extent[axis] / kFullCoordinate * static_cast<float>(at);
  }
};

// A posed organ.
struct OrganSource {
  std::uint64_t id = 0;    // of the Warper: another organ, or one cut further, has another
  std::uint64_t pose = 0;  // another for each pose of it
  const ViewManifold& manifold;
  Bounds at_rest;
  std::span<const ShellMatrix> shells;      // by face, world mm
  std::span<const std::uint8_t> two_sided;  // by face: both of its sides are skin
  bool cut = false;                         // by blades: gaps may open between samples anywhere
  const BaseLayer& base;
  // Null where the bundle cannot be lit anew, and all below empty.
  const Lighting* lighting = nullptr;
  std::span<const Eigen::Vector3f> rest_normals = {};  // by node of the base layer, unit
  std::span<const float> bends = {};  // by node, of those normals, rad a mm; empty: none
  std::span<const ShellMatrix> rest_shells = {};  // by face
  // How normals turn: C = Σ weight · turn over the first `knots` of a face's knots, linear for
  // three, quadratic for six (corners, then the middles of the edges opposite to them).
  int knots = 0;
  std::span<const std::array<std::uint32_t, 6>> knots_of_face = {};
  // By knot; below C how much more sharply skin bends there than at rest, rad a mm.
  std::vector<Eigen::Matrix<float, 4, 3>> turns = {};
};

// A bend of more is as sharp as this, where 16 bits tell it.
inline constexpr double kSharpestBend = 16;  // rad a mm

// The light at the scope, in numbers as shaders take them.
struct ScopeShading {
  // By wave: turns per mm along x, y, z, and at the origin; its slopes, and its length in mm.
  std::vector<Eigen::Vector4f> hill_phase, hill_slope;
  Eigen::Vector4f hill_variance, drops;  // of WetFilm::Drops the first four
  Eigen::Vector4f film;                  // strength, α²; WetFilm::reach()
  std::vector<Eigen::Vector2f> sheen;    // strength, α²
  Eigen::Vector3f light, forward;  // world: toward the light from the eye (mm), the view's axis
  Eigen::Vector3f scope;           // full exposure in mm²; 1 / tan² of half the beam, 1 / pixel
};

// A constant of this module, for the text of a shader: an int, a float or a vec3 there.
struct ShaderConstant {
  const char* name;
  std::variant<int, double, std::array<float, 3>> value;
};
std::vector<ShaderConstant> shader_constants();

// The pixels that blood, smoke, or solids may change.
PixelBox box_round(const BloodLine& line, const View& view);
PixelBox box_round(const SmokePuff& puff, const View& view);
PixelBox box_round(const std::vector<Solid>& solids, const View& view);
// The same solids, wider by how far from skin they still shade it by the light at the scope, and by
// the dents that they press.
std::vector<Solid> with_shadows(std::vector<Solid> solids);

// The grain's: solid gradient noise (Perlin 2002) that repeats in all three directions, with next
// to no energy at lengths below a grain. kGrainSide³ numbers, x slowest, z fastest; made once.
inline constexpr int kGrainSide = 64;
const std::vector<std::int8_t>& grain_noise();

// The range of full exposure (mm) of the one light at the scope that falls on all of the organs;
// options.scope_reference_mm where that is set, and where the light is another.
double metered_mm(const std::vector<JointDrawing::Organ>& organs, const View& view,
                  const DrawOptions& options);

// What another way of drawing throws when it cannot go on: for want of memory, of a context that is
// lost. What is wrong with a view or a bundle is an error like the processor's.
class GraphicsError : public UsageError {
 public:
  using UsageError::UsageError;
};

// Another way of drawing organs, whose pictures look like JointDrawing's. A frame's colour and
// cover are filled, its depth where it is asked for; what else it could keep is not.
class OrganDrawing {
 public:
  virtual ~OrganDrawing() = default;
  // Whether pictures appear where people look at them, and frames tell no more than their serial.
  virtual bool shows_pictures() const { return false; }
  // Why these organs cannot be drawn so with these options; empty when they can.
  virtual std::string refusal(const std::vector<JointDrawing::Organ>&, const View&,
                              const DrawOptions&) const {
    return {};
  }
  virtual DrawReport draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                          const DrawOptions& options, Frame& frame) = 0;
};

}  // namespace organbake
