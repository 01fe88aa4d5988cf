// SPDX-License-Identifier: Apache-2.0
// Draws tools: capsules, spheres and rounded plates, met by rays in closed form, whole vectors of
// them. Before that the picture is divided into blocks, each with the solids that may lie there, so
// that a long shaft costs only the blocks beside it.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "finishing/post_process.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/organ_source.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// A capsule in the camera's frame, and what all rays ask of it.
struct PlacedCapsule {
  Vector3f from, to, axis, from_eye;  // of length 1, zero for a sphere; of the eye, across the axis
  float radius, length, along;        // from the eye's height along the axis to where it begins

  PlacedCapsule(const Vector3d& begin, const Vector3d& end, double radius_mm)
      : from(begin.cast<float>()),
        to(end.cast<float>()),
        radius(static_cast<float>(radius_mm)),
        length(static_cast<float>((end - begin).norm())) {
    const Vector3d direction = length > 0 ? (end - begin).normalized() : Vector3d::Zero();
    axis = direction.cast<float>();
    along = static_cast<float>(direction.dot(begin));
    from_eye = (direction.dot(begin) * direction - begin).cast<float>();
  }
};

// The flat sides of a rounded plate.
struct PlacedPlate {
  Vector3f normal;                  // of length 1; zero where the triangle has no area
  std::array<Vector3f, 3> inwards;  // across its edges, of length 1
  std::array<float, 3> begins;      // along those
  float along, radius;              // along the normal

  PlacedPlate(const std::array<Vector3d, 3>& at, double radius_mm)
      : radius(static_cast<float>(radius_mm)) {
    const Vector3d across = (at[1] - at[0]).cross(at[2] - at[0]).stableNormalized();
    normal = across.cast<float>();
    along = static_cast<float>(across.dot(at[0]));
    for (int k = 0; k < 3; ++k) {
      const Vector3d inward = across.cross(at[(k + 1) % 3] - at[k]).stableNormalized();
      inwards[k] = inward.cast<float>();
      begins[k] = static_cast<float>(inward.dot(at[k]));
    }
  }
};

// A solid in the camera's frame: a capsule, or the plate and the capsules round its edges.
struct PlacedSolid {
  std::vector<PlacedCapsule> capsules;
  std::optional<PlacedPlate> plate;

  PlacedSolid(const Solid& solid, const RigidTransform& camera_from_world) {
    const Vector3d from = camera_from_world * solid.from, to = camera_from_world * solid.to;
    capsules.emplace_back(from, to, solid.radius_mm);
    if (!solid.corner) return;
    const Vector3d corner = camera_from_world * *solid.corner;
    capsules.emplace_back(to, corner, solid.radius_mm);
    capsules.emplace_back(corner, from, solid.radius_mm);
    plate.emplace(std::array{from, to, corner}, solid.radius_mm);
  }
};

constexpr int kBlock = 8;      // pixels a side
constexpr unsigned kEach = 4;  // rays of each of a block's columns
constexpr unsigned kRays = kEach * kBlock;
constexpr float kFar = std::numeric_limits<float>::infinity();

// Rays with z = 1, the first of eight pixels side by side, the second of each, and so on, and what
// each meets first: how far along (× ray: depth), the normal there, the cosine to the eye that
// normals reach all round the axis, the solid's number, and its colour.
struct Rays {
  template <class Number>
  using Each = std::array<Number, kRays>;
  alignas(64) Each<float> x, y, along, normal_x, normal_y, normal_z, most_facing, red, green, blue;
  alignas(64) Each<std::int32_t> solid;

  // at: of each ray from the corner of the first pixel, whose column and row these are.
  Rays(const Intrinsics& k, int column, int row,
       const std::array<std::array<float, 2>, kEach>& at) {
    const float cx = static_cast<float>(k.cx), inverse_fx = static_cast<float>(1 / k.fx);
    const float cy = static_cast<float>(k.cy), inverse_fy = static_cast<float>(1 / k.fy);
    for (unsigned ray = 0; ray < kEach; ++ray) {
      const auto [right, down] = at[ray];
      for (int p = 0; p < kBlock; ++p) {
        x[ray * kBlock + p] = (static_cast<float>(column + p) + right - cx) * inverse_fx;
        y[ray * kBlock + p] = (static_cast<float>(row) + down - cy) * inverse_fy;
      }
    }
    along.fill(kFar);
    solid.fill(0);
  }
};
static_assert(kRays % kLanes == 0);

// First hits with a capsule: of the rod round its axis between its ends, and of the balls there.
ORGANBAKE_MULTIVERSION void hit_capsule(const PlacedCapsule& capsule, std::int32_t solid,
                                        float near, Rays& __restrict rays) {
  const float from_x = capsule.from.x(), from_y = capsule.from.y(), from_z = capsule.from.z();
  const float to_x = capsule.to.x(), to_y = capsule.to.y(), to_z = capsule.to.z();
  const float axis_x = capsule.axis.x(), axis_y = capsule.axis.y(), axis_z = capsule.axis.z();
  const float eye_x = capsule.from_eye.x(), eye_y = capsule.from_eye.y();
  const float eye_z = capsule.from_eye.z(), length = capsule.length, begin = capsule.along;
  const float radius2 = capsule.radius * capsule.radius, inverse_radius = 1 / capsule.radius;
  for (unsigned i = 0; i < kRays; ++i) {
    const float x = rays.x[i], y = rays.y[i], a = x * x + y * y + 1, inverse = 1 / a;
    // Of what is round a place or an axis: `b` of the way there lies along the ray's part (u, v, w)
    // across the axis, whose squared length is `square`.
    const auto entered = [&](float b, float cx, float cy, float cz, float u, float v, float w,
                             float square) __attribute__((always_inline)) {
      const float px = cx - b * u, py = cy - b * v, pz = cz - b * w;
      const float inside = radius2 - (px * px + py * py + pz * pz);
      const float t = b - std::sqrt(std::abs(inside) / square), ahead = t > near ? t : kFar;
      return inside >= 0 ? ahead : kFar;
    };
    const float one =
        entered(inverse * (x * from_x + y * from_y + from_z), from_x, from_y, from_z, x, y, 1, a);
    const float other =
        entered(inverse * (x * to_x + y * to_y + to_z), to_x, to_y, to_z, x, y, 1, a);
    const float along = axis_x * x + axis_y * y + axis_z;
    const float u = x - along * axis_x, v = y - along * axis_y, w = 1 - along * axis_z;
    const float square = u * u + v * v + w * w;
    const float rod = entered(-(u * eye_x + v * eye_y + w * eye_z) / square, -eye_x, -eye_y, -eye_z,
                              u, v, w, square);
    const float height = rod * along - begin;
    const float before = height < 0 ? kFar : rod, side = height > length ? kFar : before;
    const float ends = one < other ? one : other, t = side < ends ? side : ends;
    const float at = t * along - begin, low = at > 0 ? at : 0, up = low < length ? low : length;
    const bool nearer = t < rays.along[i];
    const auto take = [&](Rays::Each<float> & plane, float value) __attribute__((always_inline)) {
      plane[i] = nearer ? value : plane[i];
    };
    take(rays.normal_x, inverse_radius * (t * x - from_x - up * axis_x));
    take(rays.normal_y, inverse_radius * (t * y - from_y - up * axis_y));
    take(rays.normal_z, inverse_radius * (t - from_z - up * axis_z));
    take(rays.most_facing, side < ends ? std::sqrt(square * inverse) : 1);
    rays.solid[i] = nearer ? solid : rays.solid[i];
    take(rays.along, t);
  }
}

// The same with that of a plate's sides which faces the eye.
void hit_plate(const PlacedPlate& plate, std::int32_t solid, float near, Rays& rays) {
  for (unsigned i = 0; i < kRays; ++i) {
    const Vector3f ray(rays.x[i], rays.y[i], 1);
    const float facing = plate.normal.dot(ray), side = facing < 0 ? 1.f : -1.f;
    const float t = (plate.along + side * plate.radius) / facing;
    if (facing == 0 || !(t > near && t < rays.along[i])) continue;
    const auto beyond = [&](int k) { return t * plate.inwards[k].dot(ray) < plate.begins[k]; };
    if (beyond(0) || beyond(1) || beyond(2)) continue;
    rays.along[i] = t, rays.most_facing[i] = 1, rays.solid[i] = solid;
    rays.normal_x[i] = side * plate.normal.x(), rays.normal_y[i] = side * plate.normal.y();
    rays.normal_z[i] = side * plate.normal.z();
  }
}

// Of some solids in a view, those that a block may show.
struct PlacedSolids {
  const std::vector<Solid>& solids;
  std::vector<PlacedSolid> placed;
  float near_mm;

  PlacedSolids(const std::vector<Solid>& all, const View& view)
      : solids(all), near_mm(static_cast<float>(view.near_mm)) {
    for (const Solid& solid : all) placed.emplace_back(solid, view.camera.camera_from_world);
  }
  // Whether any ray does.
  bool hit(const std::vector<std::uint32_t>& numbers, Rays& rays) const {
    for (const std::uint32_t s : numbers) {
      const auto solid = static_cast<std::int32_t>(s);
      for (const PlacedCapsule& capsule : placed[s].capsules)
        hit_capsule(capsule, solid, near_mm, rays);
      if (placed[s].plate) hit_plate(*placed[s].plate, solid, near_mm, rays);
    }
    return std::any_of(rays.along.begin(), rays.along.end(), [](float t) { return t < kFar; });
  }
  void paint(Rays& rays) const {
    for (unsigned i = 0; i < kRays; ++i) {
      const Vector3f& color = solids[rays.solid[i]].color;
      rays.red[i] = color.x(), rays.green[i] = color.y(), rays.blue[i] = color.z();
    }
  }
};

// Polished steel under a lamp at the eye, in the place of its colour: bands that fall off to the
// sides as metal's do, a bright line along the middle of a rod, whichever way it leads, and a rim
// that mirrors what lies round about. By the light at the scope in a cavity: nearly black where it
// mirrors neither, the line as narrow as the lamp, and the rim as red as the tissue that it
// mirrors.
ORGANBAKE_MULTIVERSION void shade(bool in_cavity, Rays& __restrict rays) {
  const float cavity = in_cavity ? 1.f : 0.f, room = 1 - cavity;
  for (unsigned i = 0; i < kRays; ++i) {
    const float x = rays.x[i], y = rays.y[i], inverse = 1 / std::sqrt(x * x + y * y + 1);
    const float toward =
        -inverse * (rays.normal_x[i] * x + rays.normal_y[i] * y + rays.normal_z[i]);
    const float share = (toward > 0 ? toward : 0) / rays.most_facing[i];
    const float middle = share < 1 ? share : 1, facing = middle * rays.most_facing[i];
    const float squared = middle * middle, eighth = squared * squared * squared * squared;
    const float by_32 = (eighth * eighth) * (eighth * eighth), lit = 0.3f + 0.7f * facing;
    const float aside = 1 - middle, rim = aside * aside * aside;
    const float shine = std::sqrt((rays.red[i] + rays.green[i] + rays.blue[i]) * (1 / 3.0f));
    const float steep = middle * squared;
    const float lamp = cavity * (0.03f + kSteelLit * steep * facing) +
                       room * (0.06f + (0.35f + 0.55f * facing) * steep + 0.35f * rim);
    const float line = lit * (cavity * (0.25f + shine) * (by_32 * by_32) * (by_32 * by_32) +
                              room * 0.6f * shine * by_32);
    const float mirrored = cavity * shine * aside * squared;
    const auto light = [&](float color, float tissue) __attribute__((always_inline)) {
      const float all = color * (cavity * color + room) * lamp + mirrored * tissue + line;
      return all < 1 ? all : 1;
    };
    rays.red[i] = light(rays.red[i], kTissueMirrored[0]);
    rays.green[i] = light(rays.green[i], kTissueMirrored[1]);
    rays.blue[i] = light(rays.blue[i], kTissueMirrored[2]);
  }
}

// All of a solid lies that near to the segment between its ends.
double reach_of(const Solid& solid) {
  if (!solid.corner) return solid.radius_mm;
  return solid.radius_mm +
         std::min((*solid.corner - solid.from).norm(), (*solid.corner - solid.to).norm());
}

// Eight pixels at most of a row: blends what their rays met before tissue into the picture.
void draw_pixels(const Rays& rays, int x, int y, int count, Frame& frame) {
  for (int p = 0; p < count; ++p) {
    const std::size_t at = std::size_t(y) * frame.color.width + x + p;
    const float tissue_mm = frame.depth_mm[at];
    std::array<float, 3> light{};
    float depth = kFar, share = 0;
    for (unsigned i = static_cast<unsigned>(p); i < kRays; i += kBlock) {
      if (!(rays.along[i] < tissue_mm)) continue;
      light[0] += rays.red[i], light[1] += rays.green[i], light[2] += rays.blue[i];
      depth = std::min(depth, rays.along[i]);
      share += 1.0f / kEach;
    }
    if (share == 0) continue;
    std::uint8_t* const rgb = frame.color.at(x + p, y);
    for (int c = 0; c < 3; ++c)
      rgb[c] = srgb8_from_linear(light[c] / kEach + (1 - share) * linear_from_srgb8()[rgb[c]]);
    frame.cover[at] = Cover::solid;
    frame.depth_mm[at] = depth;
  }
}

}  // namespace

PixelBox plane_box_round(const Vector3d& middle, double radius, const View& view) {
  constexpr double kFarthest_px = 1 << 24;  // boxes' sizes stay within an int's range
  const Intrinsics& k = view.camera.intrinsics;
  const double z0 = std::max(middle.z() - radius, view.near_mm), z1 = middle.z() + radius;
  if (z1 < view.near_mm) return {};
  const auto along = [&](int axis, double focal, double center) {
    const double low = middle[axis] - radius, high = middle[axis] + radius;
    const auto pixel = [&](double at) {
      return static_cast<int>(std::clamp(std::floor(at), -kFarthest_px, kFarthest_px));
    };
    return std::array{pixel(center + focal * low / (low < 0 ? z0 : z1)),
                      pixel(center + focal * high / (high > 0 ? z0 : z1) + 1)};
  };
  const auto [x0, x1] = along(0, k.fx, k.cx);
  const auto [y0, y1] = along(1, k.fy, k.cy);
  return {x0, y0, x1, y1};
}

PixelBox box_round(const Vector3d& middle, double radius, const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  return intersected(plane_box_round(middle, radius, view), {0, 0, k.width, k.height});
}

std::vector<PictureBlock> blocks_of(const std::vector<NumberedBox>& boxes, const View& view) {
  if (boxes.empty()) return {};
  const Intrinsics& k = view.camera.intrinsics;
  const int columns = (k.width + kBlock - 1) / kBlock, rows = (k.height + kBlock - 1) / kBlock;
  std::vector<PictureBlock> blocks(std::size_t(columns) * rows);
  for (const auto& [number, box] : boxes)
    each_block(box, kBlock, kBlock, [&, number = number](int column, int row) {
      auto& in_block = blocks[std::size_t(row) * columns + column].numbers;
      if (in_block.empty() || in_block.back() != number) in_block.push_back(number);
    });
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const int x = static_cast<int>(b) % columns * kBlock,
              y = static_cast<int>(b) / columns * kBlock;
    blocks[b].box = {x, y, std::min(x + kBlock, k.width), std::min(y + kBlock, k.height)};
  }
  std::erase_if(blocks, [](const PictureBlock& block) { return block.numbers.empty(); });
  return blocks;
}

// A solid lies in balls along it, as far apart as they are large: where a long shaft leads across
// the picture, they follow it.
std::vector<PictureBlock> solid_blocks(const std::vector<Solid>& solids, const View& view) {
  constexpr double kMostBalls = 1000;
  std::vector<NumberedBox> boxes;
  for (std::uint32_t s = 0; s < solids.size(); ++s) {
    const Vector3d from = view.camera.camera_from_world * solids[s].from;
    const Vector3d way = view.camera.camera_from_world * solids[s].to - from;
    const double reach = reach_of(solids[s]);
    const double pieces = std::clamp(std::ceil(way.norm() / reach), 1.0, kMostBalls);
    const double radius = std::hypot(reach, 0.5 * way.norm() / pieces);
    for (int i = 0; i <= int(pieces); ++i)
      boxes.push_back({s, box_round(from + i / pieces * way, radius, view)});
  }
  return blocks_of(boxes, view);
}

PixelBox box_round(const std::vector<Solid>& solids, const View& view) {
  PixelBox box;
  for (const PictureBlock& block : solid_blocks(solids, view)) box = united(box, block.box);
  return box;
}

void trace_solids(const std::vector<Solid>& solids, const View& view,
                  const std::function<void(int, int, const SolidSeen&)>& visit) {
  const PlacedSolids placed(solids, view);
  const std::vector<PictureBlock> blocks = solid_blocks(solids, view);
  constexpr std::array<std::array<float, 2>, kEach> kRows = {
      {{0.5f, 0.5f}, {0.5f, 1.5f}, {0.5f, 2.5f}, {0.5f, 3.5f}}};
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const PixelBox& box = blocks[b].box;
    for (int first = box.y0; first < box.y1; first += int(kEach)) {
      Rays rays(view.camera.intrinsics, box.x0, first, kRows);
      if (!placed.hit(blocks[b].numbers, rays)) continue;
      for (unsigned i = 0; i < kRays; ++i) {
        const int x = box.x0 + int(i % kBlock), y = first + int(i / kBlock);
        if (x >= box.x1 || y >= box.y1 || !(rays.along[i] < kFar)) continue;
        visit(x, y,
              {static_cast<std::uint32_t>(rays.solid[i]),
               rays.along[i],
               {rays.normal_x[i], rays.normal_y[i], rays.normal_z[i]}});
      }
    }
  });
}

void draw_solids(const std::vector<Solid>& solids, const std::vector<PictureBlock>& blocks,
                 const View& view, bool in_cavity, Frame& frame) {
  const PlacedSolids placed(solids, view);
  constexpr std::array<std::array<float, 2>, kEach> kWithin = {
      {{0.25f, 0.25f}, {0.75f, 0.25f}, {0.25f, 0.75f}, {0.75f, 0.75f}}};
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const PixelBox& box = blocks[b].box;
    for (int y = box.y0; y < box.y1; ++y) {
      Rays rays(view.camera.intrinsics, box.x0, y, kWithin);
      if (!placed.hit(blocks[b].numbers, rays)) continue;
      placed.paint(rays);
      shade(in_cavity, rays);
      draw_pixels(rays, box.x0, y, box.width(), frame);
    }
  });
}

}  // namespace organbake
