// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/error.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/warp/joint_drawing.h"

// What another way of drawing, such as graphics hardware, needs to know of a Warper's organ. All
// spans and pointers lead into the Warper, and hold until its next pose, draw or end.
namespace organbake {

// One camera's samples, kSlots of a patch that lies on one face of the shell.
struct SampleSource {
  static constexpr std::uint32_t kSlots = 64;  // of a patch; those beyond its count are not drawn
  struct Patch {
    std::uint32_t face = 0, count = 0;
    // In the face's shell coordinates b1, b2, h (mm): middle, half sizes, change by texel column
    // and row.
    std::array<float, 3> center, extent, along_u, along_v;
    float sine = 0, cosine = 1;  // of the widest angle of a normal to the patch's own
  };
  std::vector<Patch> patches;
  // By slot: center + extent · coordinate / 32767.
  std::span<const std::int16_t> b1, b2, h;
  // By slot, from the lowest byte on: red, green, blue (square-root light), confidence, and the
  // brightness' first differences along u and v and half of its second ones (signed).
  std::span<const std::uint64_t> detail;
  // By slot: red, green and blue of the texel's corners, and in the highest bytes its own red,
  // green, blue and confidence; empty where a bundle has no light at the scope.
  std::span<const std::array<std::uint32_t, 4>> smooth;
  double texel_mm = 0;  // mean size on the surface
};

// A posed organ.
struct OrganSource {
  std::uint64_t id = 0;        // of the Warper: another organ, or one cut further, has another
  std::uint64_t whole_id = 0;  // of the Warper that blades have cut it from, or its own
  const ViewManifold& manifold;
  Bounds at_rest;
  std::span<const ShellMatrix> shells;      // by face, world mm
  std::span<const std::uint8_t> two_sided;  // by face: both of its sides are skin
  // By face: not as in the whole organ, or wet. Patches on other faces are the same, and so are the
  // base layer's nodes. Empty: nothing is cut; else gaps may open anywhere.
  std::span<const std::uint8_t> parted = {};
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
  std::vector<Eigen::Matrix3f> turns = {};  // by knot
};

// A bend of more is as sharp as this, where 16 bits tell it.
inline constexpr double kSharpestBend = 16;  // rad a mm

// The light at the scope, in numbers as shaders take them.
struct ScopeShading {
  struct Wave {
    std::array<float, 4> phase;  // turns per mm along x, y, z, and at the origin
    std::array<float, 3> slope;
    float length_mm = 1, variance = 0;
  };
  struct Lobe {
    float strength = 0, alpha2 = 1;
  };
  std::array<Wave, 4> hills;
  float bumps_per_mm = 1, bump_slope = 0, drops = 0;
  Lobe film;
  std::array<Lobe, 2> sheen;
  float least_cosine = 2;
  // World: toward the light from the eye (mm), the view's axis; full exposure in mm².
  std::array<float, 3> light, forward;
  float full = 1, inverse_tan2_half = 1, inverse_pixel = 1;
};

// A constant of this module, for the text of a shader.
struct ShaderConstant {
  const char* name;
  double value;
};
std::vector<ShaderConstant> shader_constants();

// The grain's noise: kGrainSide³ numbers, x slowest, z fastest.
inline constexpr int kGrainSide = 64;
std::span<const std::int8_t> grain_noise();

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
  virtual std::string refusal(const std::vector<JointDrawing::Organ>& organs, const View& view,
                              const DrawOptions& options) const = 0;
  virtual DrawReport draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                          const DrawOptions& options, Frame& frame) = 0;
};

}  // namespace organbake
