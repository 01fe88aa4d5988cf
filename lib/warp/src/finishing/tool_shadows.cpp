// SPDX-License-Identifier: Apache-2.0
// All of it from distances between segments: a shadow where the way to the light passes a capsule,
// with a penumbra as wide as the light is (Quilez 2010, "Soft shadows in raymarched SDFs", by the
// nearest point in the place of marching); ambient occlusion by the gap, and in a dent by how far
// below its rim skin lies, redder the darker by what tissue sends to tissue (Jimenez et al. 2016,
// "Practical realtime strategies for accurate indirect occlusion"); a mirror image where the
// mirrored ray passes a capsule within a few millimetres.
#include "finishing/post_process.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"
#include "organbake/core/smooth_step.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

double dent_reach(double radius_mm, const Vector3d& pressed_mm) {
  return pressed_mm.isZero(0) ? 0 : kDentReach * (radius_mm + pressed_mm.norm());
}

// In camera axes.
struct Capsule {
  Vector3d from, axis;
  double radius;
  float color;
  Vector3d pressed = Vector3d::Zero();
  Vector3d inward = pressed.stableNormalized();
  double depth = pressed.norm(), squared_length = axis.squaredNorm();
  double dent = dent_reach(radius, pressed), reach = std::max(kShadeReach_mm, dent);

  // From its axis, at the point nearest to a place, to that.
  Vector3d way_to(const Vector3d& place) const {
    const Vector3d way = place - from;
    const double along = way.dot(axis);
    if (!(along > 0)) return way;
    return way - std::min(along / squared_length, 1.0) * axis;
  }
};

std::vector<Capsule> capsules_of(const Solid& solid, const RigidTransform& pose) {
  const Vector3d a = pose * solid.from, b = pose * solid.to;
  const float color = kSteelLit * solid.color.cwiseAbs2().mean();  // as draw_solids() lights it
  std::vector<Capsule> capsules = {
      {a, b - a, solid.radius_mm, color, pose.rotation * solid.pressed_mm}};
  if (!solid.corner) return capsules;
  const Vector3d c = pose * *solid.corner;
  capsules.push_back({b, c - b, solid.radius_mm, color});
  capsules.push_back({c, a - c, solid.radius_mm, color});
  return capsules;
}

struct Passing {
  double gap;    // between the ray and the capsule's surface, mm; below 0: through it
  double along;  // the ray, mm
};

// Where a ray from p along the unit direction d, `length` long, is nearest to a capsule (Ericson
// 2005, 5.1.9).
Passing passing(const Vector3d& p, const Vector3d& d, double length, const Capsule& capsule) {
  const Vector3d& axis = capsule.axis;
  const Vector3d r = p - capsule.from;
  const double e = capsule.squared_length, f = axis.dot(r), c = d.dot(r), b = d.dot(axis);
  const double denominator = e - b * b;
  double s = denominator > 1e-9 ? std::clamp((b * f - c * e) / denominator, 0.0, length) : 0;
  const double t = e > 1e-12 ? std::clamp((b * s + f) / e, 0.0, 1.0) : 0;
  s = std::clamp(b * t - c, 0.0, length);
  return {(r + s * d - t * axis).norm() - capsule.radius, s};
}

// What a capsule's dent leaves of the light on skin in it: all at its rim, where the skin lay, and
// the less the deeper, most of it lost in the upper half, so that the rim shows.
double kept_in_dent(const Capsule& capsule, const Vector3d& way, double gap) {
  const double below =
      std::clamp((way.dot(capsule.inward) - capsule.radius) / capsule.depth + 1, 0.0, 1.0);
  return 1 - kDarkestDent * capsule.depth / (capsule.depth + 0.5 * capsule.radius) * below *
                 (2 - below) * smooth_step(capsule.dent, 0, gap);
}

struct Skin {
  Vector3d place, normal;  // camera axes; the normal is 0 where the skin breaks off
};

// Of what the tools leave of a pixel's light, and what they add.
struct ToolShade {
  double kept = 1, in_dent = 1, mirrored = 0;
};

// By a capsule within reach, `gap` mm away.
void shade_by(const Capsule& capsule, double gap, const Skin& skin,
              const std::optional<Vector3d>& light, ToolShade& shade) {
  const double touches = smooth_step(kShadeReach_mm, 0.4 * kShadeReach_mm, gap);
  const double near_mm = kOccludedNear_mm + kOccludedByRadius * capsule.radius;
  double kept = 1 - kOccluded * touches * std::exp(-gap / near_mm);
  if (light) {
    const Vector3d way = *light - skin.place;
    const double range = std::max(way.norm(), 1.0);
    const Passing shadow = passing(skin.place, way / range, range, capsule);
    const double soft = kLeastSoft_mm + kLampRadius_mm * shadow.along / range;
    kept *= 1 - kDarkestShadow * touches * smooth_step(soft, -soft, shadow.gap);
  }
  shade.kept = std::min(shade.kept, kept);
  if (!light || skin.normal.isZero(0)) return;
  const Vector3d sight = skin.place.normalized();
  const double facing = -sight.dot(skin.normal);
  if (!(facing > 0)) return;
  const Vector3d mirror = sight + 2 * facing * skin.normal;
  const Passing image = passing(skin.place, mirror, kMirrorReach_mm, capsule);
  const double grazing = 1 - facing, squared = grazing * grazing;
  const double fresnel = kWaterMirror + (1 - kWaterMirror) * squared * squared * grazing;
  const double shown =
      smooth_step(0.3, -0.3, image.gap) * (1 - image.along / kMirrorReach_mm) * capsule.color;
  shade.mirrored = std::max(shade.mirrored, std::min(fresnel, 0.4) * shown);
}

class Shading {
 public:
  Shading(const std::vector<Solid>& solids, const View& view, const std::optional<Vector3d>& light,
          Frame& frame)
      : k_(view.camera.intrinsics), light_(light), frame_(frame) {
    for (const Solid& solid : solids)
      capsules_.push_back(capsules_of(solid, view.camera.camera_from_world));
  }

  // Drops of a block the solids that reach none of its skin: most blocks of a shaft.
  void keep_near(PictureBlock& block) const {
    const Ball skin = ball_of(block.box);
    std::erase_if(block.numbers, [&](std::uint32_t s) {
      return std::none_of(capsules_[s].begin(), capsules_[s].end(), [&](const Capsule& capsule) {
        return capsule.way_to(skin.middle).norm() < skin.radius + capsule.radius + capsule.reach;
      });
    });
  }
  void shade(const PictureBlock& block) {
    const PixelBox& box = block.box;
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        const Cover cover = frame_.cover[std::size_t(y) * frame_.color.width + x];
        if (cover == Cover::background || !std::isfinite(depth(x, y))) continue;
        const ToolShade shade = shade_at(x, y, block.numbers);
        const auto kept = static_cast<float>(shade.kept * shade.in_dent);
        const auto mirrored = static_cast<float>(shade.mirrored * shade.in_dent);
        if (kept > 0.995f && mirrored < 0.001f) continue;
        std::uint8_t* const rgb = frame_.color.at(x, y);
        for (int c = 0; c < 3; ++c) {
          const float returned = kept / (1 - kTissueMirrored[c] * (1 - kept));
          rgb[c] = srgb8_from_linear(returned * linear_from_srgb8()[rgb[c]] + mirrored);
        }
      }
  }

 private:
  struct Ball {
    Vector3d middle = Vector3d::Zero();
    double radius = -std::numeric_limits<double>::infinity();  // of no skin
  };
  // That all skin of a box lies in.
  Ball ball_of(const PixelBox& box) const {
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        if (!std::isfinite(depth(x, y))) continue;
        nearest = std::min(nearest, depth(x, y)), farthest = std::max(farthest, depth(x, y));
      }
    if (!(nearest <= farthest)) return {};
    const Vector3d low = direction(box.x0, box.y0), high = direction(box.x1 - 1, box.y1 - 1);
    const Vector3d across = direction(box.x1 - 1, box.y0), down = direction(box.x0, box.y1 - 1);
    Ball ball{0.25 * (nearest + farthest) * (low + high), 0};
    for (const Vector3d& corner : {low, high, across, down})
      for (const double z : {nearest, farthest})
        ball.radius = std::max(ball.radius, (z * corner - ball.middle).norm());
    return ball;
  }
  // Most skin of a block is out of every capsule's reach, and needs no normal.
  ToolShade shade_at(int x, int y, const std::vector<std::uint32_t>& solids) const {
    ToolShade shade;
    std::optional<Skin> skin;
    const Vector3d here = place(x, y);
    for (const std::uint32_t s : solids)
      for (const Capsule& capsule : capsules_[s]) {
        const Vector3d way = capsule.way_to(here);
        const double far = capsule.radius + capsule.reach;
        if (way.squaredNorm() >= far * far) continue;
        const double gap = std::max(0.0, way.norm() - capsule.radius);
        if (capsule.depth > 0)
          shade.in_dent = std::min(shade.in_dent, kept_in_dent(capsule, way, gap));
        if (gap >= kShadeReach_mm) continue;
        if (!skin) skin = {here, light_ ? normal(x, y) : Vector3d::Zero()};
        shade_by(capsule, gap, *skin, light_, shade);
      }
    return shade;
  }

  float depth(int x, int y) const {
    return frame_.depth_mm[std::size_t(y) * frame_.color.width + x];
  }
  Vector3d direction(int x, int y) const {
    return {(x + 0.5 - k_.cx) / k_.fx, (y + 0.5 - k_.cy) / k_.fy, 1};
  }
  Vector3d place(int x, int y) const { return depth(x, y) * direction(x, y); }
  // Toward the eye, over some pixels each way; 0 beside borders and edges.
  Vector3d normal(int x, int y) const {
    if (x < kNormalReach || y < kNormalReach || x + kNormalReach >= frame_.color.width ||
        y + kNormalReach >= frame_.color.height)
      return Vector3d::Zero();
    const float here = depth(x, y);
    for (const auto& [u, v] : {std::pair(x - kNormalReach, y), std::pair(x + kNormalReach, y),
                               std::pair(x, y - kNormalReach), std::pair(x, y + kNormalReach)})
      if (!(std::abs(depth(u, v) - here) < float(kSteepestNormal) * here)) return Vector3d::Zero();
    const Vector3d across = place(x + kNormalReach, y) - place(x - kNormalReach, y);
    const Vector3d down = place(x, y + kNormalReach) - place(x, y - kNormalReach);
    return down.cross(across).stableNormalized();
  }

  const Intrinsics& k_;
  std::optional<Vector3d> light_;
  Frame& frame_;
  std::vector<std::vector<Capsule>> capsules_;
};

}  // namespace

std::vector<Solid> with_shadows(std::vector<Solid> solids) {
  for (Solid& solid : solids)
    solid.radius_mm += std::max(kShadeReach_mm, dent_reach(solid.radius_mm, solid.pressed_mm));
  return solids;
}

void shade_skin_by_solids(const std::vector<Solid>& solids, const View& view,
                          const std::optional<Vector3d>& light_mm, Frame& frame, KeptPixels& kept) {
  Shading shading(solids, view, light_mm, frame);
  std::vector<PictureBlock> blocks = solid_blocks(with_shadows(solids), view);
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) { shading.keep_near(blocks[b]); });
  std::erase_if(blocks, [](const PictureBlock& block) { return block.numbers.empty(); });
  for (const PictureBlock& block : blocks) kept.keep(block.box, frame);
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) { shading.shade(blocks[b]); });
}

}  // namespace organbake
