// SPDX-License-Identifier: Apache-2.0
#include "warp/draw_state.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "geometry/shell_map.h"
#include "warp/pixel_key.h"

namespace organbake {
namespace {

using Vec4 = Eigen::Vector4f;  // of three dimensions, the fourth zero

// What makes a face two-sided: a corner pushed by more than this share of the organ's size, and a
// normal farther from the mean of its corners' than 6°.
constexpr double kPushedShare = 0.02, kBentCosine = 0.995;

ShellColumns columns_of(const ShellMatrix& matrix) {
  ShellColumns columns = ShellColumns::Zero();
  columns.topRows<3>() = matrix.cast<float>();
  return columns;
}

// The patch's middle in the view's frame, its derivatives along b1, b2, h, and the half size of a
// box that surely holds all of it.
struct PlacedPatch {
  Vec4 center, by_b1, by_b2, by_h, half;
  Vec4 along(const float (&t)[3]) const { return by_b1 * t[0] + by_b2 * t[1] + by_h * t[2]; }
};

PlacedPatch place(const Patch& patch, const ShellColumns& m) {
  const auto [b1, b2, h] = std::tuple(patch.center[0], patch.center[1], patch.center[2]);
  const Vec4 c4 = m.col(4), c5 = m.col(5);
  PlacedPatch p;
  p.by_b1 = m.col(1) + h * c4;
  p.by_b2 = m.col(2) + h * c5;
  p.by_h = m.col(3) + b1 * c4 + b2 * c5;
  p.center = m.col(0) + b1 * m.col(1) + b2 * m.col(2) + h * p.by_h;
  const auto [e1, e2, eh] = std::tuple(patch.extent[0], patch.extent[1], patch.extent[2]);
  // Exact for the shell map, which is linear but for the products h·b.
  p.half = e1 * p.by_b1.cwiseAbs() + e2 * p.by_b2.cwiseAbs() + eh * p.by_h.cwiseAbs() +
           eh * (e1 * c4.cwiseAbs() + e2 * c5.cwiseAbs());
  return p;
}

// Columns run right, rows down, so v × u points out of the surface.
Vec4 outward(const PlacedPatch& p, const Patch& patch) {
  return p.along(patch.along_v).cross3(p.along(patch.along_u));
}

// Whether every normal within the cone about `normal` points away from the eye, wherever in its box
// the sample lies: seen from the eye the box spans asin(radius / distance), which the cone is
// widened by.
bool faces_away(const PlacedPatch& p, const Vec4& normal, const NormalCone& cone) {
  const float along = normal.dot(p.center);
  if (!(along > 0)) return false;  // most that is seen
  const float squared_radius = p.half.squaredNorm();
  const float squared_tangent = p.center.squaredNorm() - squared_radius;
  if (!(squared_tangent > 0)) return false;
  const float radius = std::sqrt(squared_radius), tangent = std::sqrt(squared_tangent);
  const float sine = cone.sine * tangent + cone.cosine * radius;
  const float cosine = cone.cosine * tangent - cone.sine * radius;
  return cosine > 0 && along > sine * normal.norm();
}

int clamped_int(float value, int low, int high) {
  // Written so that NaN becomes `low`.
  return value > low ? (value < high ? static_cast<int>(value) : high) : low;
}

// Pixels that a box of camera space can reach, by interval arithmetic, grown by half a splat; and
// whether the view cuts it.
void set_box(const PlacedPatch& p, const View& view, ChunkFrame& out) {
  const Intrinsics& k = view.camera.intrinsics;
  const float near = static_cast<float>(view.near_mm);
  const float z0 = std::max(p.center.z() - p.half.z(), near), z1 = p.center.z() + p.half.z();
  if (z1 < near) return;
  const auto interval = [&](float c, float r, float f, float middle, int pixels) {
    const float grow = 0.5f * static_cast<float>(pixels) + 1;
    const float low = c - r, high = c + r;
    return std::pair(middle + f * (low < 0 ? low / z0 : low / z1) - grow,
                     middle + f * (high > 0 ? high / z0 : high / z1) + grow + 1);
  };
  const auto [x0, x1] = interval(p.center.x(), p.half.x(), static_cast<float>(k.fx),
                                 static_cast<float>(k.cx), out.columns);
  const auto [y0, y1] = interval(p.center.y(), p.half.y(), static_cast<float>(k.fy),
                                 static_cast<float>(k.cy), out.rows);
  out.box = {clamped_int(x0, 0, k.width), clamped_int(y0, 0, k.height), clamped_int(x1, 0, k.width),
             clamped_int(y1, 0, k.height)};
  out.uncut = z0 > near && x0 >= 0 && y0 >= 0 && x1 <= static_cast<float>(k.width) &&
              y1 <= static_cast<float>(k.height);
}

// Texels smaller than this many pixels are all alike; keeps offsets within an int's range.
constexpr float kSmallestTexel = 0.02f;

// Fills the 2 × 2 map between pixels and texels at the patch's middle, and what follows from it.
void set_footprint(const PlacedPatch& p, const Vec4& s_u, const Vec4& s_v, const View& view,
                   ChunkFrame& out) {
  const Intrinsics& k = view.camera.intrinsics;
  const float z = std::max(p.center.z(), static_cast<float>(view.near_mm));
  const float fx = static_cast<float>(k.fx) / z, fy = static_cast<float>(k.fy) / z;
  const float px = p.center.x() / z, py = p.center.y() / z;
  const float x_u = fx * (s_u.x() - px * s_u.z()), y_u = fy * (s_u.y() - py * s_u.z());
  const float x_v = fx * (s_v.x() - px * s_v.z()), y_v = fy * (s_v.y() - py * s_v.z());
  const float size =
      std::max({std::abs(x_u), std::abs(y_u), std::abs(x_v), std::abs(y_v), kSmallestTexel});
  float determinant = x_u * y_v - x_v * y_u;
  // Seen edge-on the map has no inverse; a thousandth of its size keeps offsets finite.
  const float least = 1e-3f * size * size;
  if (std::abs(determinant) < least) determinant = determinant < 0 ? -least : least;
  const float inverse = 1 / (determinant * kReach);
  out.u_x = y_v * inverse, out.u_y = -x_v * inverse;
  out.v_x = -y_u * inverse, out.v_y = x_u * inverse;
  out.z_u = kReach * s_u.z(), out.z_v = kReach * s_v.z();
  // The most pixel centres that a texel's own parallelogram can hold along each axis.
  out.columns = clamped_int(std::ceil(std::abs(x_u) + std::abs(x_v)), 1, kMostSplat);
  out.rows = clamped_int(std::ceil(std::abs(y_u) + std::abs(y_v)), 1, kMostSplat);
}

bool bent_over(const TriangleMesh& deformed, const TriangleMesh& at_rest,
               const std::vector<Eigen::Vector3d>& normals, std::uint32_t f, double pushed_mm) {
  const Face& face = deformed.faces[f];
  const bool pushed = std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
    return (deformed.vertices[v] - at_rest.vertices[v]).norm() > pushed_mm;
  });
  if (!pushed) return false;
  const Eigen::Vector3d skin = normals[face[0]] + normals[face[1]] + normals[face[2]];
  return face_normal(deformed, f).dot(skin) < kBentCosine * skin.norm();
}

}  // namespace

std::vector<FaceFrame> face_frames(const TriangleMesh& deformed, const TriangleMesh& at_rest,
                                   const View& view) {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(deformed);
  const double pushed_mm = kPushedShare * bounds(at_rest).diagonal();
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  Eigen::Matrix3d projection;
  projection << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1;
  std::vector<FaceFrame> frames(deformed.faces.size());
  for (std::uint32_t f = 0; f < frames.size(); ++f) {
    frames[f].two_sided = bent_over(deformed, at_rest, normals, f, pushed_mm);
    ShellMatrix metric = pose.rotation * shell_matrix(deformed, normals, f);
    metric.col(0) += pose.translation;
    const ShellMatrix pixel = projection * metric;
    frames[f].metric = columns_of(metric);
    frames[f].pixel = columns_of(pixel);
  }
  return frames;
}

Eigen::Vector3d patch_normal(const Patch& patch, const ShellMatrix& face) {
  return outward(place(patch, columns_of(face)), patch).head<3>().cast<double>();
}

ChunkFrame chunk_frame(const Patch& patch, const FaceFrame& face, const View& view) {
  ChunkFrame out{};
  const PlacedPatch p = place(patch, face.metric);
  if (!face.two_sided && faces_away(p, outward(p, patch), patch.cone)) {
    out.fate = ChunkFate::faces_away;
    return out;
  }
  set_footprint(p, p.along(patch.along_u), p.along(patch.along_v), view, out);
  set_box(p, view, out);
  out.fate = out.box.empty() ? ChunkFate::outside_view : ChunkFate::drawn;
  return out;
}

}  // namespace organbake
