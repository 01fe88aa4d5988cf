// SPDX-License-Identifier: Apache-2.0
// Blood and smoke, over pixels that are drawn: each bead colours the skin that lies within it, as
// thick as it is high there, and each puff what lies behind it.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "finishing/post_process.h"
#include "organbake/core/parallel.h"
#include "organbake/core/smooth_step.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/organ_source.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// In the blocks that some wounds' boxes touch: light(x, y, rgb, depth, numbers), where `numbers`
// are those of a block's wounds.
template <class Wound, class Light>
void draw_blocks(const std::vector<Wound>& wounds, const View& view, Frame& frame, KeptPixels& kept,
                 const Light& light) {
  std::vector<NumberedBox> boxes;
  for (const Wound& wound : wounds)
    boxes.push_back({static_cast<std::uint32_t>(boxes.size()), box_round(wound, view)});
  const std::vector<PictureBlock> blocks = blocks_of(boxes, view);
  for (const PictureBlock& block : blocks) kept.keep(block.box, frame);
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const auto& [box, numbers] = blocks[b];
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x)
        light(x, y, frame.color.at(x, y), frame.depth_mm[std::size_t(y) * frame.color.width + x],
              numbers);
  });
}

// Of a line of blood, camera axes.
struct Bead {
  Vector3d from, axis, outward, down_wall;
  double from_radius, widens, per_squared_length, farthest2;

  Bead(const BloodLine& line, const RigidTransform& pose)
      : from(pose * line.from_mm),
        axis(pose * line.to_mm - from),
        outward(pose.rotation * line.outward),
        down_wall(pose.rotation * line.down_wall),
        from_radius(line.from_radius_mm),
        widens(line.to_radius_mm - line.from_radius_mm),
        per_squared_length(1 / std::max(axis.squaredNorm(), 1e-12)),
        farthest2(std::pow(std::max(line.from_radius_mm, line.to_radius_mm) / kBloodBelow, 2)) {}
};

// How high blood stands over a place, and how much of the lamp shows there, by beads that stand
// about as high: a highlight does not break off where the next bead begins.
struct Film {
  Vector3d half_way;  // between lamp and eye; zero without a lamp
  double height_mm = 0, shine = 0, weight = 0;

  // The pool has the shape of cos⁸ of the angle from down the wall: pools of beads whose ways down
  // part leave no teeth between them.
  void add(const Bead& bead, const Vector3d& place) {
    const Vector3d way = place - bead.from;
    const double along = std::clamp(way.dot(bead.axis) * bead.per_squared_length, 0.0, 1.0);
    Vector3d aside = way - along * bead.axis;
    double away2 = aside.squaredNorm();
    if (away2 >= bead.farthest2) return;
    const double radius = bead.from_radius + along * bead.widens, down = bead.down_wall.dot(aside);
    double reach = radius;
    if (down > 0) {
      const double cosine2 = down * down / away2, cosine4 = cosine2 * cosine2;
      reach *= 1 + (1 / kBloodBelow - 1) * cosine4 * cosine4;
    } else {
      away2 -= (1 - kBloodAbove * kBloodAbove) * down * down;
      aside -= (1 - kBloodAbove) * down * bead.down_wall;
    }
    const double height = radius * (1 - away2 / (reach * reach));
    if (!(height > 0)) return;
    height_mm = std::max(height_mm, height);
    const Vector3d normal = bead.outward + kBloodBulge / reach * aside -
                            bead.widens * bead.per_squared_length * bead.axis;
    const double squared = height * height, by_4 = squared * squared, by_8 = by_4 * by_4;
    weight += by_8;
    shine += by_8 * (1 - smooth_step(0, kBloodPool_mm, down)) *
             smooth_step(kBloodDull, kBloodShiny, half_way.dot(normal.normalized()));
  }
};

}  // namespace

PixelBox box_round(const BloodLine& line, const View& view) {
  const double radius = std::max(line.from_radius_mm, line.to_radius_mm);
  const double deep = radius / kBloodBelow, widest = 0.3 * deep;  // where cos⁸ is
  const Intrinsics& k = view.camera.intrinsics;
  const PixelBox picture = {0, 0, k.width, k.height};
  PixelBox box;
  bool ends_behind = false;  // the eye: it leaves the picture anywhere
  const auto add = [&](const Vector3d& place_mm, double reach) {
    const Vector3d middle = view.camera.camera_from_world * place_mm;
    ends_behind |= middle.z() - reach < view.near_mm;
    box = united(box, plane_box_round(middle, reach, view));
  };
  for (const Vector3d& end : {line.from_mm, line.to_mm}) {
    add(end - radius / kBloodAbove * line.down_wall, radius);
    add(end + (deep - widest) * line.down_wall, widest);
  }
  return ends_behind && !box.empty() ? picture : intersected(box, picture);
}

PixelBox box_round(const SmokePuff& puff, const View& view) {
  return box_round(view.camera.camera_from_world * puff.middle_mm, puff.radius_mm, view);
}

void draw_blood(const std::vector<BloodLine>& blood, const View& view,
                const std::optional<Vector3d>& light_mm, Frame& frame, KeptPixels& kept) {
  std::vector<Bead> beads;
  for (const BloodLine& line : blood) beads.emplace_back(line, view.camera.camera_from_world);
  const auto& linear = linear_from_srgb8();
  draw_blocks(
      blood, view, frame, kept,
      [&](int x, int y, std::uint8_t* rgb, float depth, const auto& numbers) {
        if (!std::isfinite(depth)) return;
        const Vector3d place = depth * unproject(view.camera.intrinsics, {x + 0.5, y + 0.5});
        Film film{Vector3d::Zero()};
        if (light_mm)
          film.half_way = ((*light_mm - place).normalized() - place.normalized()).normalized();
        for (const std::uint32_t n : numbers) film.add(beads[n], place);
        if (film.height_mm == 0) return;
        const double covers = 1 - std::exp(-film.height_mm / kBloodClear_mm);
        const double shine = film.shine / std::max(film.weight, 1e-300) *
                             smooth_step(1, 4, film.height_mm * view.camera.intrinsics.fx / depth);
        const float lit = linear[rgb[0]];  // red comes back from all tissue
        for (int c = 0; c < 3; ++c)
          rgb[c] = srgb8_from_linear(static_cast<float>(
              (1 - covers) * linear[rgb[c]] + covers * (kBlood[c] * lit + kBloodShine * shine)));
      });
}

void draw_smoke(const std::vector<SmokePuff>& smoke, const View& view, Frame& frame,
                KeptPixels& kept) {
  std::vector<Vector3d> middles;
  for (const SmokePuff& puff : smoke)
    middles.push_back(view.camera.camera_from_world * puff.middle_mm);
  const auto& linear = linear_from_srgb8();
  draw_blocks(
      smoke, view, frame, kept,
      [&](int x, int y, std::uint8_t* rgb, float depth, const auto& numbers) {
        const Vector3d sight = unproject(view.camera.intrinsics, {x + 0.5, y + 0.5});
        double clear = 1;
        for (const std::uint32_t n : numbers) {
          const double radius = smoke[n].radius_mm,
                       nearest = sight.dot(middles[n]) / sight.squaredNorm();
          const double far2 = (nearest * sight - middles[n]).squaredNorm() / (radius * radius);
          // As much of it as lies before what is seen there.
          const double before = std::clamp(0.5 + 0.5 * (depth - middles[n].z()) / radius, 0.0, 1.0);
          if (far2 < 1) clear *= 1 - smoke[n].share * before * (1 - far2) * (1 - far2);
        }
        for (int c = 0; c < 3; ++c)
          rgb[c] = srgb8_from_linear(
              static_cast<float>(clear * linear[rgb[c]] + (1 - clear) * kSmokeLight[c]));
      });
}

}  // namespace organbake
