// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/cutting/bleeding.h"
#include "organbake/warp/view.h"

namespace organbake {

// Which light the skin is drawn in.
enum class DrawnLight : std::uint8_t {
  baked,  // that its colours were taken in, wherever it is pushed
  world,  // the same lamps and sky, on the skin as it lies now
  scope,  // one light that travels with the view (ScopeLight)
};

// Each light's name in documents, options and messages, and what it is called on a screen, in the
// order of DrawnLight. This is the only list of them: whoever reads or offers a light follows it.
struct LightNames {
  const char *name, *title;
};
inline constexpr std::array<LightNames, 3> kLightNames = {
    {{"baked", "as baked"}, {"world", "of the room"}, {"scope", "at the scope"}}};
inline const char* to_string(DrawnLight light) { return kLightNames[std::size_t(light)].name; }
std::optional<DrawnLight> drawn_light(std::string_view name);  // nothing for another name
std::string all_lights();  // "baked, world or scope", for messages

// Texels of less confidence are not drawn: of 255 it rounds to 0.
inline constexpr float kLeastConfidence = 0.5f / 255;

// An instrument's part, world millimetres: all that lies within the radius of a segment, a point
// (both ends agree) or, with a third corner, a triangle: a capsule, a sphere or a rounded plate.
struct Solid {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double radius_mm = 1;
  std::optional<Eigen::Vector3d> corner = {};
  Eigen::Vector3f color = Eigen::Vector3f::Constant(0.35f);  // linear
  std::uint32_t instrument = 0;                              // that it is a part of
  // How it has pressed skin in from rest, world mm: in what direction, and how deep.
  Eigen::Vector3d pressed_mm = Eigen::Vector3d::Zero();

  bool operator==(const Solid& other) const = default;
};

// Skin that a grasper's jaws draw together into a ridge. It is shorter than the edges of the mesh
// that the tissue is reckoned on, so it is there in pictures alone. World, mm.
struct SkinFold {
  Eigen::Vector3d middle_mm;       // of the skin, before it is drawn together
  Eigen::Vector3d along, outward;  // unit: the ridge's, and across it to where it rises
  double reach_mm = 0;             // from its middle to its foot
  double closed = 0;               // 0: as the skin lies … 1

  bool operator==(const SkinFold& other) const = default;
};

struct DrawOptions {
  std::array<std::uint8_t, 3> background = {22, 23, 26};  // sRGB
  // In its place a cavity's unlit wall: dark and red-brown.
  static constexpr std::array<std::uint8_t, 3> kCavity = {30, 11, 9};
  // Blend skin with the background by the share of each pixel that it covers (post_process.h), by
  // the paper's own warp, too. And fade it where the bundle asks for that
  // (SkinFinish::border_fade_rad); not where several organs are in the picture.
  bool smooth_outline = true;
  // None: a Player takes what its organs are meant for, everything else what was baked, as the
  // paper's own warp always does.
  std::optional<DrawnLight> light = {};
  // The range of full exposure of the light at the scope, mm; 0: as the bundle's ScopeLight says.
  // For several organs, which are lit by one.
  double scope_reference_mm = 0;
  bool keep_depth = false;  // also fill Frame::depth_mm; implied by solids
  bool keep_bound = false;  // also fill Frame::bound
  // To the faces that are drawn (Warper::drawn_skin()), mostly fewer than the organ's own in a
  // picture of large pixels: enough for who asks for depth alone.
  bool bind_as_drawn = false;
  bool measure = false;  // fill DrawReport's times
  std::vector<Solid> solids = {};
  std::vector<SkinFold> folds = {};  // of a smooth skin; a Player fills them from its graspers
  // A Player fills them from its cuts. They change colours alone.
  std::vector<BloodLine> blood = {};
  std::vector<SmokePuff> smoke = {};

  bool relights() const { return light && *light != DrawnLight::baked; }
  bool needs_depth() const {
    return keep_depth || !solids.empty() || !blood.empty() || !smoke.empty();
  }
  bool operator==(const DrawOptions& other) const = default;
};

class SkinDepth;
// Smooths all outlines of a picture, of which colour and covers are asked for: against the
// background and, where depths are known, against skin that lies deeper.
void smooth_outlines(Frame& frame, const SkinDepth* depth = nullptr, float deeper_mm = 0);

// What the ray through a pixel's centre meets first of the solids.
struct SolidSeen {
  std::uint32_t solid = 0;  // its place in the list
  float depth_mm = 0;       // planar z
  Eigen::Vector3f normal;   // camera axes, unit, outward
};

// Calls visit(x, y, seen) for every pixel whose centre a solid lies at, from several threads at
// once, each pixel one time. Whether something else lies before it is the caller's to ask.
void trace_solids(const std::vector<Solid>& solids, const View& view,
                  const std::function<void(int, int, const SolidSeen&)>& visit);

// Milliseconds of processor time by phase; zero unless measured.
struct DrawTimes {
  double transform = 0;  // faces and chunks placed, culled and listed by tile
  double splat = 0, base = 0, resolve = 0, fill = 0;
  double tools = 0;  // instruments drawn into the picture

  double total() const { return transform + splat + base + resolve + fill + tools; }

  DrawTimes& operator+=(const DrawTimes& more) {
    transform += more.transform, splat += more.splat, base += more.base;
    resolve += more.resolve, fill += more.fill, tools += more.tools;
    return *this;
  }
};

struct DrawReport {
  bool unchanged = false;  // same view, positions and options: the frame was left alone
  // Tiles of which anything was drawn, and those that stayed since nothing moved there.
  int tiles_drawn = 0, tiles_kept = 0;
  ViewWeights weights;             // the cameras in use
  float texel_mm = 0;              // mean size of their texels on the surface
  std::size_t samples_drawn = 0;   // of chunks that were drawn
  std::size_t base_triangles = 0;  // of its blocks that were looked at
  std::size_t sample_pixels = 0, base_pixels = 0, filled_pixels = 0;
  DrawTimes times;          // of work, summed over threads
  DrawTimes critical_path;  // of its longest chain: more threads do not shorten it (WorkMeter)
};

}  // namespace organbake
