// SPDX-License-Identifier: Apache-2.0
// Where a view sees faces and the patches of samples on them, by whole vectors, with bounds that
// hold all of a patch.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/geometry/shell.h"
#include "picture/spans.h"
#include "placing/placing.h"

namespace organbake {
namespace {

constexpr std::size_t kPlacedGrain = 128;  // faces of a piece

ShellColumns columns_of(const ShellMatrix& matrix) {
  ShellColumns columns = ShellColumns::Zero();
  columns.topRows<3>() = matrix.cast<float>();
  return columns;
}

// Of a face's corners, which its relief is small beside.
float nearest_corner_mm(const ShellColumns& metric) {
  return metric(2, 0) + std::min({0.0f, metric(2, 1), metric(2, 2)});
}

inline float larger(float a, float b) { return a > b ? a : b; }
inline int clamped_int(float value, int low, int high) {
  // Written so that NaN becomes `low`.
  return value > low ? (value < high ? static_cast<int>(value) : high) : low;
}

// Three coordinates that stay in registers, lane by lane.
struct Triple {
  float x, y, z;

  Triple operator+(const Triple& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Triple operator*(float s) const { return {x * s, y * s, z * s}; }
  float dot(const Triple& o) const { return x * o.x + y * o.y + z * o.z; }
  Triple cross(const Triple& o) const {
    return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x};
  }
  Triple absolute() const { return {std::abs(x), std::abs(y), std::abs(z)}; }
};

// The view's numbers.
struct Placing {
  float fx, fy, cx, cy, near;
  int width, height;
};

inline float length(const Triple& t) { return std::sqrt(t.dot(t)); }

// The patch's middle in the view's frame, its derivatives along b1, b2, h, and the half size of a
// box that surely holds all of it.
struct PlacedPatch {
  Triple center, by_b1, by_b2, by_h, half;
  float bend;  // sine of the angle by which normals turn within it, at most

  // Of a patch's middle and extent (b1, b2, h); m: the columns of its face's shell matrix.
  [[gnu::always_inline]] PlacedPatch(const Triple& at, const Triple& extent,
                                     const std::array<Triple, 9>& m) {
    const float b1 = at.x, b2 = at.y, h = at.z;
    by_b1 = m[1] + m[4] * h;
    by_b2 = m[2] + m[5] * h;
    by_h = m[3] + m[4] * b1 + m[5] * b2;
    center = m[0] + m[1] * b1 + m[2] * b2 + by_h * h;
    const float e1 = extent.x, e2 = extent.y, eh = extent.z;
    // Exact for a flat face's shell map, which is linear but for the products h·b.
    half = by_b1.absolute() * e1 + by_b2.absolute() * e2 + by_h.absolute() * eh +
           (m[4].absolute() * e1 + m[5].absolute() * e2) * eh;
    // On a bent one its squares come on top.
    const Triple bend1 = m[6] * b1 + m[7] * b2, bend2 = m[8] * b2;
    center = center + bend1 * b1 + bend2 * b2;
    const Triple more1 = bend1 + m[6] * b1, more2 = bend2 * 2 + m[7] * b1;
    by_b1 = by_b1 + more1, by_b2 = by_b2 + more2;
    const Triple turn1 = m[6].absolute() * (2 * e1) + m[7].absolute() * e2,
                 turn2 = m[7].absolute() * e1 + m[8].absolute() * (2 * e2);
    half = half + more1.absolute() * e1 + more2.absolute() * e2 + m[6].absolute() * (e1 * e1) +
           m[7].absolute() * (e1 * e2) + m[8].absolute() * (e2 * e2);
    bend = length(turn1) / larger(length(by_b1), 1e-30f) +
           length(turn2) / larger(length(by_b2), 1e-30f);
  }
  [[gnu::always_inline]] Triple along(const Triple& t) const {
    return by_b1 * t.x + by_b2 * t.y + by_h * t.z;
  }
};

// Whether every normal within the cone about `normal` points away from the eye, wherever in its box
// the sample lies: seen from the eye the box spans asin(radius / distance), which the cone is
// widened by, and by the bend. (The sum of two angles is less than that of their sines.)
[[gnu::always_inline]] inline bool faces_away(const PlacedPatch& p, const Triple& normal,
                                              float sine, float cosine) {
  const float along = normal.dot(p.center);
  const float squared_distance = p.center.dot(p.center);
  const float radius = length(p.half) + (p.bend > 0 ? p.bend * std::sqrt(squared_distance) : 0);
  const float squared_tangent = squared_distance - radius * radius;
  const float tangent = std::sqrt(larger(squared_tangent, 0));
  const float wide_sine = sine * tangent + cosine * radius;
  const float wide_cosine = cosine * tangent - sine * radius;
  return (along > 0) & (squared_tangent > 0) & (wide_cosine > 0) &
         (along > wide_sine * std::sqrt(normal.dot(normal)));
}

// Texels smaller than this many pixels are all alike; keeps offsets within an int's range.
constexpr float kSmallestTexel = 0.02f;

// A batch's frames, number by number, as a loop over vectors leaves them.
struct Batch {
  template <class Number>
  using Each = std::array<Number, kPatchBatch>;
  static_assert(kPatchBatch % kLanes == 0);
  alignas(64) Each<float> u_x, u_y, v_x, v_y, z_u, z_v, z0;
  // away: a flag; turned: whether its middle faces away, even if not all of it does.
  alignas(64) Each<int> columns, rows, x0, y0, x1, y1, away, turned;
};

// The 2 × 2 map between pixels and texels at the patch's middle, and what follows from it.
[[gnu::always_inline]] inline void put_footprint(const PlacedPatch& p, const Triple& s_u,
                                                 const Triple& s_v, const Placing& to, unsigned i,
                                                 Batch& out) {
  const float inverse_z = 1 / larger(p.center.z, to.near);
  const float fx = to.fx * inverse_z, fy = to.fy * inverse_z;
  const float px = p.center.x * inverse_z, py = p.center.y * inverse_z;
  const float x_u = fx * (s_u.x - px * s_u.z), y_u = fy * (s_u.y - py * s_u.z);
  const float x_v = fx * (s_v.x - px * s_v.z), y_v = fy * (s_v.y - py * s_v.z);
  const float size =
      larger(larger(larger(std::abs(x_u), std::abs(y_u)), larger(std::abs(x_v), std::abs(y_v))),
             kSmallestTexel);
  const float exact = x_u * y_v - x_v * y_u;
  // Seen edge-on the map has no inverse; a thousandth of its size keeps offsets finite.
  const float least = 1e-3f * size * size;
  const float determinant = std::abs(exact) < least ? (exact < 0 ? -least : least) : exact;
  const float inverse = 1 / (determinant * kReach);
  out.u_x[i] = y_v * inverse, out.u_y[i] = -x_v * inverse;
  out.v_x[i] = -y_u * inverse, out.v_y[i] = x_u * inverse;
  out.z_u[i] = kReach * s_u.z, out.z_v[i] = kReach * s_v.z;
  // The most pixel centres that a texel's own parallelogram can hold along each axis.
  out.columns[i] = clamped_int(std::ceil(std::abs(x_u) + std::abs(x_v)), 1, kMostSplat);
  out.rows[i] = clamped_int(std::ceil(std::abs(y_u) + std::abs(y_v)), 1, kMostSplat);
}

// Pixels along one axis that a box of camera space can reach, by interval arithmetic, grown by half
// a splat; z0 and z1 are the box's depths, z0 not before the near plane.
struct Interval {
  float low, high;

  [[gnu::always_inline]] Interval(float center, float half, float z0, float z1, float focal,
                                  float middle, int pixels) {
    const float grow = 0.5f * static_cast<float>(pixels) + 1;
    const float from = center - half, to = center + half;
    low = middle + focal * (from / (from < 0 ? z0 : z1)) - grow;
    high = middle + focal * (to / (to > 0 ? z0 : z1)) + grow + 1;
  }
};

[[gnu::always_inline]] inline void put_bounds(const PlacedPatch& p, const Placing& to, unsigned i,
                                              Batch& out) {
  const float z0 = larger(p.center.z - p.half.z, to.near), z1 = p.center.z + p.half.z;
  const Interval x(p.center.x, p.half.x, z0, z1, to.fx, to.cx, out.columns[i]);
  const Interval y(p.center.y, p.half.y, z0, z1, to.fy, to.cy, out.rows[i]);
  out.z0[i] = z0;
  out.x0[i] = clamped_int(x.low, 0, to.width), out.y0[i] = clamped_int(y.low, 0, to.height);
  // Nothing, when all of it lies before the near plane.
  out.x1[i] = clamped_int(z1 < to.near ? 0 : x.high, 0, to.width);
  out.y1[i] = clamped_int(y.high, 0, to.height);
}

using Numbers = std::array<const float*, PatchTable::kNumbers>;
// Of each patch's face, number by number.
using Columns = std::array<std::array<float, kPatchBatch>, 27>;

// By whole vectors, over the borders of faces, of which most have one or two patches: one by one,
// choosing and placing what a frame draws takes half as long again.
[[gnu::flatten]] ORGANBAKE_MULTIVERSION void place(const Numbers& of_patches, const Columns& f,
                                                   int count, Placing to, Batch& __restrict out) {
  const Numbers n = of_patches;
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const auto number = [&](int k) { return Triple{n[k][i], n[k + 1][i], n[k + 2][i]}; };
    const auto column = [&](int k) {
      return Triple{f[3 * k][i], f[3 * k + 1][i], f[3 * k + 2][i]};
    };
    const PlacedPatch p(number(0), number(3),
                        {column(0), column(1), column(2), column(3), column(4), column(5),
                         column(6), column(7), column(8)});
    const Triple s_u = p.along(number(6)), s_v = p.along(number(9));
    put_footprint(p, s_u, s_v, to, i, out);
    put_bounds(p, to, i, out);
    // Columns run right, rows down, so v × u points out of the surface.
    const Triple normal = s_v.cross(s_u);
    out.away[i] = faces_away(p, normal, n[12][i], n[13][i]);
    out.turned[i] = normal.dot(p.center) > 0;
  }
}

ChunkFrame frame_at(const Batch& b, int i, const FaceFrame& face) {
  ChunkFrame out{};
  if (b.away[i] && !face.two_sided) {
    out.visibility = ChunkVisibility::faces_away;
    return out;
  }
  out.u_x = b.u_x[i], out.u_y = b.u_y[i], out.v_x = b.v_x[i], out.v_y = b.v_y[i];
  out.z_u = b.z_u[i], out.z_v = b.z_v[i], out.nearest_mm = b.z0[i];
  out.columns = b.columns[i], out.rows = b.rows[i];
  out.box = {b.x0[i], b.y0[i], b.x1[i], b.y1[i]};
  out.left_to_base = b.turned[i] && face.near && !face.two_sided;
  out.visibility = out.box.empty() ? ChunkVisibility::outside_view : ChunkVisibility::drawn;
  return out;
}

}  // namespace

void PlacedFaces::place(const PosedShell& shell, const View& view, float texel_mm, bool continued) {
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  frames_.resize(shell.matrices().size());
  continued_ = continued;
  const float near_mm = static_cast<float>(k.fx) * texel_mm / kNearTexel_px;
  moved_.resize(frames_.size());
  revisions_.resize(frames_.size());
  const auto place_face = [&](std::size_t f) {
    moved_[f] = revisions_[f] != shell.revisions()[f];
    if (!moved(f)) return;
    revisions_[f] = shell.revisions()[f];
    frames_[f].two_sided = shell.two_sided(f);
    ShellMatrix metric = pose.rotation * shell.matrices()[f];
    metric.col(0) += pose.translation;
    ShellMatrix pixel = metric;
    pixel.row(0) = k.fx * metric.row(0) + k.cx * metric.row(2);
    pixel.row(1) = k.fy * metric.row(1) + k.cy * metric.row(2);
    frames_[f].metric = columns_of(metric);
    frames_[f].near = nearest_corner_mm(frames_[f].metric) <= near_mm;
    frames_[f].pixel = columns_of(pixel);
  };
  parallel_each(std::size_t{0}, frames_.size(), kPlacedGrain, place_face);
}

void PlacedFaces::add_moved(std::span<const std::uint8_t> changed) {
  if (!continued_) return;
  for (std::size_t f = 0; f < moved_.size(); ++f) moved_[f] |= changed[f];
}

void place_patches(const PatchTable& patches, std::size_t first, int count,
                   std::span<const FaceFrame> faces, const View& view, ChunkFrame* frames) {
  Numbers numbers;
  for (int k = 0; k < PatchTable::kNumbers; ++k) numbers[k] = patches.number(k) + first;
  alignas(64) Columns columns;
  for (int i = 0; i < count; ++i) {
    const ShellColumns& metric = faces[patches.face(first + i)].metric;
    for (int k = 0; k < 9; ++k)
      for (int axis = 0; axis < 3; ++axis) columns[3 * k + axis][i] = metric(axis, k);
  }
  Batch batch;
  const Intrinsics& k = view.camera.intrinsics;
  const Placing to{float(k.fx),         float(k.fy), float(k.cx), float(k.cy),
                   float(view.near_mm), k.width,     k.height};
  place(numbers, columns, count, to, batch);
  for (int i = 0; i < count; ++i) frames[i] = frame_at(batch, i, faces[patches.face(first + i)]);
}

Eigen::Vector3d patch_normal(const Patch& patch, const ShellMatrix& face) {
  const Eigen::Matrix3d shell =
      shell_jacobian(face, patch.center[0], patch.center[1], patch.center[2]);
  const Eigen::Vector3d u = shell * Eigen::Map<const Eigen::Vector3f>(patch.along_u).cast<double>();
  const Eigen::Vector3d v = shell * Eigen::Map<const Eigen::Vector3f>(patch.along_v).cast<double>();
  return v.cross(u);
}

}  // namespace organbake
