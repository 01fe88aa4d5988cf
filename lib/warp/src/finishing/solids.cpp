// SPDX-License-Identifier: Apache-2.0
// Draws tools: capsules, spheres and rounded plates, met by rays in closed form. Before that the
// picture is divided into blocks, each with the solids that planes through the eye and its sides
// cannot rule out, so that a long shaft costs only the blocks beside it.
#include "organbake/warp/solids.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "picture/tiles.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

struct Hit {
  double along = std::numeric_limits<double>::infinity();  // × ray; the ray has z = 1: depth
  Vector3d normal = Vector3d::Zero();
  double most_facing = 1;  // the cosine to the eye that normals there reach, all round the axis
};

// A capsule in the camera's frame, and what all rays ask of it.
struct PlacedCapsule {
  Vector3d from, to;
  double radius;
  double length;
  Vector3d axis;                                        // of length 1; zero for a sphere
  Vector3d from_eye;                                    // of the eye, across the axis
  double from_clearance, to_clearance, side_clearance;  // squared distance to the eye − radius²

  PlacedCapsule(const Vector3d& begin, const Vector3d& end, double radius_mm)
      : from(begin),
        to(end),
        radius(radius_mm),
        length((to - from).norm()),
        axis(Vector3d::Zero()) {
    if (length > 0) axis = (to - from) / length;
    from_eye = -from + axis * axis.dot(from);
    from_clearance = from.squaredNorm() - radius * radius;
    to_clearance = to.squaredNorm() - radius * radius;
    side_clearance = from_eye.squaredNorm() - radius * radius;
  }
};

// The flat sides of a rounded plate.
struct PlacedPlate {
  std::array<Vector3d, 3> corners;
  Vector3d normal;                  // of length 1; zero where the triangle has no area
  std::array<Vector3d, 3> inwards;  // across the edges that begin at the corners

  explicit PlacedPlate(const std::array<Vector3d, 3>& at) : corners(at) {
    normal = (at[1] - at[0]).cross(at[2] - at[0]).stableNormalized();
    for (int k = 0; k < 3; ++k) inwards[k] = normal.cross(at[(k + 1) % 3] - at[k]);
  }
};

// A solid in the camera's frame: a capsule, or the plate and the capsules round its edges.
struct PlacedSolid {
  std::vector<PlacedCapsule> capsules;
  std::optional<PlacedPlate> plate;
  Eigen::Vector3f color;
  double reach;  // of all of it from the first capsule's axis

  PlacedSolid(const Solid& solid, const RigidTransform& camera_from_world)
      : color(solid.color), reach(solid.radius_mm) {
    const Vector3d from = camera_from_world * solid.from, to = camera_from_world * solid.to;
    capsules.emplace_back(from, to, solid.radius_mm);
    if (!solid.corner) return;
    const Vector3d corner = camera_from_world * *solid.corner;
    capsules.emplace_back(to, corner, solid.radius_mm);
    capsules.emplace_back(corner, from, solid.radius_mm);
    plate.emplace(std::array{from, to, corner});
    reach += std::min((corner - from).norm(), (corner - to).norm());
  }
};

// First hit of the ray t·d (from the eye) with a sphere.
void hit_sphere(const Vector3d& d, const Vector3d& center, double clearance, double radius,
                double near, Hit& hit) {
  const double a = d.squaredNorm(), b = d.dot(center);
  const double discriminant = b * b - a * clearance;
  if (discriminant < 0) return;
  const double t = (b - std::sqrt(discriminant)) / a;
  if (t > near && t < hit.along) hit = {t, (t * d - center) / radius};
}

// The same with a capsule. Its ends lie within the endless rod along its axis: a ray that enters
// that beside the capsule meets the end on that side or nothing.
void hit_capsule(const Vector3d& d, const PlacedCapsule& solid, double near, Hit& hit) {
  const Vector3d& axis = solid.axis;
  const Vector3d across = d - axis * axis.dot(d);
  const double a = across.squaredNorm(), b = across.dot(solid.from_eye);
  const double discriminant = b * b - a * solid.side_clearance;
  const bool aslant = solid.length > 0 && a > 0;
  if (aslant && discriminant < 0) return;
  const double t = aslant ? (-b - std::sqrt(discriminant)) / a : near;
  const double height = axis.dot(t * d - solid.from);
  if (t > near && height >= 0 && height <= solid.length) {
    if (t < hit.along)
      hit = {t, (t * d - solid.from - axis * height) / solid.radius, std::sqrt(a) / d.norm()};
    return;
  }
  if (!(t > near && height > 0))
    hit_sphere(d, solid.from, solid.from_clearance, solid.radius, near, hit);
  if (solid.length > 0 && !(t > near && height < 0))
    hit_sphere(d, solid.to, solid.to_clearance, solid.radius, near, hit);
}

// The same with that of a plate's sides which faces the eye.
void hit_plate(const Vector3d& d, const PlacedPlate& plate, double radius, double near, Hit& hit) {
  const double facing = plate.normal.dot(d);
  if (facing == 0) return;
  const Vector3d outward = facing < 0 ? plate.normal : Vector3d(-plate.normal);
  const double t = (outward.dot(plate.corners[0]) + radius) / outward.dot(d);
  if (!(t > near && t < hit.along)) return;
  for (int k = 0; k < 3; ++k)
    if (plate.inwards[k].dot(t * d - plate.corners[k]) < 0) return;
  hit = {t, outward};
}

void hit_solid(const Vector3d& d, const PlacedSolid& solid, double near, Hit& hit) {
  for (const PlacedCapsule& capsule : solid.capsules) hit_capsule(d, capsule, near, hit);
  if (solid.plate) hit_plate(d, *solid.plate, solid.capsules.front().radius, near, hit);
}

// The first of some solids that a ray hits.
struct FirstHit : Hit {
  const PlacedSolid* solid = nullptr;

  FirstHit(const Vector3d& d, const std::vector<PlacedSolid>& all,
           const std::vector<std::uint32_t>& numbers, double near) {
    for (const std::uint32_t s : numbers) {
      const double before = along;
      hit_solid(d, all[s], near, *this);
      if (along < before) solid = &all[s];
    }
  }
};

Vector3d ray_through(const Intrinsics& k, double x, double y) {
  return {(x - k.cx) / k.fx, (y - k.cy) / k.fy, 1};
}

// How far a hit faces the eye beside all that do round the axis: 1 along the middle of a rod.
double middle_of(const Hit& hit, const Vector3d& d) {
  return std::min(1.0, std::max(0.0, -hit.normal.dot(d)) / (d.norm() * hit.most_facing));
}

// Polished steel under a lamp at the eye: bands that fall off to the sides as metal's do, a bright
// line along the middle of a rod, whichever way it leads, and a rim that mirrors what lies round
// about. By the light at the scope in a cavity: nearly black where it mirrors neither, the line as
// narrow as the lamp, and the rim as red as the tissue that it mirrors.
Eigen::Vector3f shade(const PlacedSolid& solid, const Hit& hit, const Vector3d& d, bool in_cavity) {
  const float middle = static_cast<float>(middle_of(hit, d));
  const float facing = middle * static_cast<float>(hit.most_facing);
  const float squared = middle * middle, eighth = squared * squared * squared * squared;
  const float by_32 = (eighth * eighth) * (eighth * eighth), lit = 0.3f + 0.7f * facing;
  const float aside = 1 - middle, rim = aside * aside * aside;
  const float shine = std::sqrt(solid.color.mean());
  if (in_cavity) {
    const Eigen::Vector3f tissue(kTissueMirrored[0], kTissueMirrored[1], kTissueMirrored[2]);
    const float lamp = 0.03f + 0.4f * middle * squared * facing;
    const float line = (0.25f + shine) * (by_32 * by_32) * (by_32 * by_32) * lit;
    return (solid.color.cwiseAbs2() * lamp + shine * aside * squared * tissue +
            line * Eigen::Vector3f::Ones())
        .cwiseMin(1.0f);
  }
  const float lamp = 0.06f + (0.35f + 0.55f * facing) * middle * squared + 0.35f * rim;
  const float line = 0.6f * by_32 * lit;
  return (solid.color * lamp + shine * line * Eigen::Vector3f::Ones()).cwiseMin(1.0f);
}

constexpr int kSide = 2;  // rays a pixel, each way

// Of a pixel: the tools' light by the rays that hit, and what share of the rays those are.
struct PixelHit {
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
  float share = 0;
  double depth = std::numeric_limits<double>::infinity();
  double middle = 0;  // most of its rays' middle_of()
};

// The solids, narrower by more than a pixel: where the ray through a pixel's centre meets them, its
// other rays meet the solids.
std::vector<Solid> narrower_by_a_pixel(std::vector<Solid> solids, const View& view) {
  constexpr double kLeast_mm = 1e-6;
  for (Solid& solid : solids) {
    double farthest_mm = 0;
    for (const Vector3d& at : {solid.from, solid.to, solid.corner.value_or(solid.to)})
      farthest_mm = std::max(farthest_mm, (view.camera.camera_from_world * at).norm());
    const double pixel_mm = (farthest_mm + solid.radius_mm) / view.camera.intrinsics.fx;
    solid.radius_mm = std::max(kLeast_mm, solid.radius_mm - pixel_mm);
  }
  return solids;
}

// What may be seen of the solids in a block, as they are and narrower by a pixel.
struct NearSolids {
  const std::vector<PlacedSolid>&all, &narrower;
  const std::vector<std::uint32_t>& numbers;
  const View& view;

  Vector3d sub_ray(int x, int y, int ray) const {
    return ray_through(view.camera.intrinsics, x + (ray % kSide + 0.5) / kSide,
                       y + (ray / kSide + 0.5) / kSide);
  }
  // Whether all rays of a pixel hit one solid, and none another.
  bool fill(const Vector3d& center, int x, int y) const {
    const PlacedSolid* one = FirstHit(center, narrower, numbers, 0).solid;
    if (!one) return false;
    for (const std::uint32_t s : numbers)
      for (int ray = 0; ray < kSide * kSide && &narrower[s] != one; ++ray) {
        Hit other;
        hit_solid(sub_ray(x, y, ray), all[s], 0, other);
        if (std::isfinite(other.along)) return false;
      }
    return true;
  }
  void trace(const Vector3d& d, double tissue_depth, bool in_cavity, float share,
             PixelHit& pixel) const {
    const FirstHit hit(d, all, numbers, view.near_mm);
    if (!hit.solid || !(hit.along < tissue_depth)) return;
    pixel.color += share * shade(*hit.solid, hit, d, in_cavity);
    pixel.depth = std::min(pixel.depth, hit.along);
    pixel.middle = std::max(pixel.middle, middle_of(hit, d));
    pixel.share += share;
  }
  // Well within one solid, beside the lamp's streak, and before or behind the tissue by more than a
  // pixel is deep, one ray tells all of a pixel.
  PixelHit trace_pixel(int x, int y, double tissue_depth, bool in_cavity) const {
    const Vector3d center = ray_through(view.camera.intrinsics, x + 0.5, y + 0.5);
    PixelHit pixel;
    if (fill(center, x, y)) {
      trace(center, std::numeric_limits<double>::infinity(), in_cavity, 1, pixel);
      constexpr double kDeep_px = 4, kStreak = 0.95;
      const double deep_mm = kDeep_px * pixel.depth / view.camera.intrinsics.fx;
      if (pixel.share == 0 || pixel.depth - deep_mm > tissue_depth) return {};
      if (pixel.depth + deep_mm < tissue_depth && pixel.middle < kStreak) return pixel;
      pixel = {};
    }
    for (int ray = 0; ray < kSide * kSide; ++ray)
      trace(sub_ray(x, y, ray), tissue_depth, in_cavity, 1.0f / (kSide * kSide), pixel);
    return pixel;
  }
};

std::vector<PlacedSolid> placed_in(const View& view, const std::vector<Solid>& solids) {
  const RigidTransform& pose = view.camera.camera_from_world;
  std::vector<PlacedSolid> placed;
  placed.reserve(solids.size());
  for (const Solid& solid : solids) placed.emplace_back(solid, pose);
  return placed;
}

constexpr int kBlock = 8;  // pixels a side

// A solid's length is cut into as many pieces as a word has bits: where a long shaft leads across
// the picture, the boxes of its pieces follow it.
using Pieces = std::uint32_t;
constexpr int kPieces = 32;

using PieceEnds = std::array<Vector3d, kPieces + 1>;

PieceEnds piece_ends(const PlacedSolid& solid) {
  PieceEnds ends;
  const PlacedCapsule& along = solid.capsules.front();
  for (int i = 0; i <= kPieces; ++i)
    ends[i] = along.from + (double(i) / kPieces) * (along.to - along.from);
  return ends;
}

// The pieces that lie wholly beyond a plane: height_of tells how far a place does.
template <class HeightOf>
Pieces pieces_beyond(const PieceEnds& ends, double radius, HeightOf&& height_of) {
  Pieces pieces = 0;
  bool last = height_of(ends[0]) > radius;
  for (int i = 0; i < kPieces; ++i) {
    const bool next = height_of(ends[i + 1]) > radius;
    pieces |= Pieces{last && next} << i;
    last = next;
  }
  return pieces;
}

// For each block along one axis of the picture, the solid's pieces that may be seen there: those
// not wholly beyond one of the two planes through the eye and the block's sides.
std::vector<Pieces> pieces_seen(const PieceEnds& ends, double radius, int axis, double focal,
                                double center, int size) {
  std::vector<Pieces> seen;
  for (int first = 0; first < size; first += kBlock) {
    const auto beyond = [&](double pixel, double sign) {
      const double slope = (pixel - center) / focal, length = std::hypot(1, slope);
      return pieces_beyond(ends, radius, [&](const Vector3d& p) {
        return sign * (p[axis] - slope * p.z()) / length;
      });
    };
    seen.push_back(~(beyond(first, -1) | beyond(first + kBlock, 1)));
  }
  return seen;
}

void draw_pixel(const PixelHit& hit, int x, int y, Frame& frame) {
  const std::size_t at = std::size_t(y) * frame.color.width + x;
  std::uint8_t* rgb = frame.color.at(x, y);
  for (int k = 0; k < 3; ++k)
    rgb[k] = srgb8_from_linear(hit.color[k] + (1 - hit.share) * linear_from_srgb8()[rgb[k]]);
  frame.cover[at] = Cover::solid;
  frame.depth_mm[at] = static_cast<float>(hit.depth);
}

}  // namespace

std::vector<SolidBlock> solid_blocks(const std::vector<Solid>& solids, const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  const std::vector<PlacedSolid> placed = placed_in(view, solids);
  std::vector<std::vector<Pieces>> by_column, by_row;
  for (const PlacedSolid& solid : placed) {
    const PieceEnds ends = piece_ends(solid);
    const Pieces near =
        pieces_beyond(ends, solid.reach, [&](const Vector3d& p) { return view.near_mm - p.z(); });
    by_column.push_back(pieces_seen(ends, solid.reach, 0, k.fx, k.cx, k.width));
    for (Pieces& pieces : by_column.back()) pieces &= ~near;
    by_row.push_back(pieces_seen(ends, solid.reach, 1, k.fy, k.cy, k.height));
  }
  std::vector<SolidBlock> blocks;
  for (int y = 0; y < k.height; y += kBlock) {
    for (int x = 0; x < k.width; x += kBlock) {
      SolidBlock block{{x, y, std::min(x + kBlock, k.width), std::min(y + kBlock, k.height)}, {}};
      for (std::uint32_t s = 0; s < placed.size(); ++s) {
        if (by_column[s][x / kBlock] & by_row[s][y / kBlock]) block.solids.push_back(s);
      }
      if (!block.solids.empty()) blocks.push_back(std::move(block));
    }
  }
  return blocks;
}

void trace_solids(const std::vector<Solid>& solids, const View& view,
                  const std::function<void(int, int, const SolidSeen&)>& visit) {
  const std::vector<PlacedSolid> placed = placed_in(view, solids);
  const std::vector<SolidBlock> blocks = solid_blocks(solids, view);
  const auto trace = [&](const SolidBlock& block, int x, int y) {
    const FirstHit hit(ray_through(view.camera.intrinsics, x + 0.5, y + 0.5), placed, block.solids,
                       view.near_mm);
    if (!hit.solid) return;
    visit(x, y,
          {static_cast<std::uint32_t>(hit.solid - placed.data()), static_cast<float>(hit.along),
           hit.normal.cast<float>()});
  };
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const PixelBox& box = blocks[b].box;
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) trace(blocks[b], x, y);
  });
}

void draw_solids(const std::vector<Solid>& solids, const std::vector<SolidBlock>& blocks,
                 const View& view, bool in_cavity, Frame& frame) {
  const std::vector<PlacedSolid> placed = placed_in(view, solids);
  const std::vector<PlacedSolid> narrower = placed_in(view, narrower_by_a_pixel(solids, view));
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const NearSolids near{placed, narrower, blocks[b].solids, view};
    const PixelBox& box = blocks[b].box;
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        const float tissue_mm = frame.depth_mm[std::size_t(y) * frame.color.width + x];
        const PixelHit hit = near.trace_pixel(x, y, tissue_mm, in_cavity);
        if (hit.share > 0) draw_pixel(hit, x, y, frame);
      }
    }
  });
}

}  // namespace organbake
