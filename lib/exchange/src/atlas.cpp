// SPDX-License-Identifier: GPL-3.0-or-later
// One atlas of colours and normals for a surface of any number of faces: texels ask the bundle's
// base layer for its shape and the maps for what they show; the rest is filled from around, so that
// no filter mixes in black.
#include "atlas.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"
#include "organbake/image/grow.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr std::uint32_t kFree = 0xFFFFFFFFu;
constexpr float kBeyond = 1.5f;   // texels outside a face that a bilinear filter may still ask for
constexpr int kPaddedRings = 16;  // beyond those, for coarser levels of a mip map

using Weights = std::array<double, 3>;

// Of the corners at a point of the plane; they sum to 1.
Weights weights_at(const std::array<Eigen::Vector2d, 3>& t, const Eigen::Vector2d& p) {
  const Eigen::Vector2d e1 = t[1] - t[0], e2 = t[2] - t[0], d = p - t[0];
  const double area = e1.x() * e2.y() - e1.y() * e2.x();
  const double b1 = (d.x() * e2.y() - d.y() * e2.x()) / area;
  const double b2 = (e1.x() * d.y() - e1.y() * d.x()) / area;
  return {1 - b1 - b2, b1, b2};
}

// A face in texels, x right and y down from the atlas's top left corner.
std::array<Eigen::Vector2d, 3> texel_corners(const TexturedMesh& mesh, std::size_t face, int side) {
  std::array<Eigen::Vector2d, 3> corners;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d& uv = mesh.coordinates[mesh.faces[face][k].coordinate];
    corners[k] = {side * uv.x(), side * (1 - uv.y())};
  }
  return corners;
}

// Which face each texel shows: the one it lies in, or the nearest within kBeyond.
std::vector<std::uint32_t> owners(const TexturedMesh& mesh, int side) {
  std::vector<std::uint32_t> owner(std::size_t(side) * side, kFree);
  std::vector<float> depth_inside(owner.size(), -kBeyond);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const auto corners = texel_corners(mesh, f, side);
    std::array<double, 3> height;  // of the corner over the edge against it
    const Eigen::Vector2d e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
    const double doubled = std::abs(e1.x() * e2.y() - e1.y() * e2.x());
    if (!(doubled > 0)) continue;
    Eigen::Vector2d low = corners[0], high = corners[0];
    for (int k = 0; k < 3; ++k) {
      height[k] = doubled / (corners[(k + 2) % 3] - corners[(k + 1) % 3]).norm();
      low = low.cwiseMin(corners[k]);
      high = high.cwiseMax(corners[k]);
    }
    const auto clamped = [&](double at) {
      return std::clamp(static_cast<int>(std::floor(at)), 0, side - 1);
    };
    for (int y = clamped(low.y() - kBeyond); y <= clamped(high.y() + kBeyond); ++y)
      for (int x = clamped(low.x() - kBeyond); x <= clamped(high.x() + kBeyond); ++x) {
        const Weights w = weights_at(corners, {x + 0.5, y + 0.5});
        const auto inside =
            static_cast<float>(std::min({w[0] * height[0], w[1] * height[1], w[2] * height[2]}));
        float& best = depth_inside[std::size_t(y) * side + x];
        if (inside <= best) continue;
        best = inside;
        owner[std::size_t(y) * side + x] = f;
      }
  }
  return owner;
}

// Free texels take the mean of their neighbours, ring by ring; what is left `elsewhere`.
void pad(Rgb8Image& image, const std::vector<std::uint32_t>& owner,
         std::array<std::uint8_t, 3> elsewhere) {
  std::vector<std::uint8_t> known(owner.size());
  for (std::size_t i = 0; i < owner.size(); ++i) known[i] = owner[i] != kFree;
  grow(image.width, image.height, kPaddedRings, known,
       [&](std::size_t texel, std::span<const std::size_t> beside) {
         const std::size_t count = beside.size();
         for (int k = 0; k < 3; ++k) {
           std::size_t sum = 0;
           for (const std::size_t other : beside) sum += image.pixels[3 * other + k];
           image.pixels[3 * texel + k] = static_cast<std::uint8_t>((sum + count / 2) / count);
         }
       });
  for (std::size_t i = 0; i < known.size(); ++i)
    if (!known[i]) std::copy(elsewhere.begin(), elsewhere.end(), &image.pixels[3 * i]);
}

std::array<std::uint8_t, 3> mean_color(const Rgb8Image& image,
                                       const std::vector<std::uint32_t>& owner) {
  double sum[3] = {};
  double count = 0;
  for (std::size_t i = 0; i < owner.size(); ++i) {
    if (owner[i] == kFree) continue;
    for (int k = 0; k < 3; ++k) sum[k] += image.pixels[3 * i + k];
    ++count;
  }
  std::array<std::uint8_t, 3> mean{};
  for (int k = 0; k < 3; ++k)
    mean[k] = static_cast<std::uint8_t>(std::lround(sum[k] / std::max(1.0, count)));
  return mean;
}

class AtlasBaker {
 public:
  AtlasBaker(const FineSurface& fine, const Lighting* light, int side, TexturedMesh& mesh)
      : fine_(fine), light_(light), side_(side), mesh_(mesh) {}

  void run() {
    mesh_.color = Rgb8Image(side_, side_);
    mesh_.normal_map = Rgb8Image(side_, side_);
    const std::vector<std::uint32_t> owner = owners(mesh_, side_);
    parallel_for(0, side_, [&](int y) {
      for (int x = 0; x < side_; ++x) {
        const std::uint32_t face = owner[std::size_t(y) * side_ + x];
        if (face != kFree) fill(x, y, face);
      }
    });
    pad(mesh_.color, owner, mean_color(mesh_.color, owner));
    pad(mesh_.normal_map, owner, {128, 128, 255});
  }

 private:
  void fill(int x, int y, std::uint32_t face) {
    const Weights w = weights_at(texel_corners(mesh_, face, side_), {x + 0.5, y + 0.5});
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), normal = place, tangent = place;
    for (int k = 0; k < 3; ++k) {
      const TexturedMesh::Corner& corner = mesh_.faces[face][k];
      place += w[k] * mesh_.vertices[corner.vertex];
      normal += w[k] * mesh_.normals[corner.vertex];
      tangent += w[k] * mesh_.tangents[corner.coordinate];
    }
    const FineSurface::Appearance at = fine_.at(place);
    Eigen::Vector3f color = at.color;
    if (light_) {
      const Eigen::Vector3f diffuse = light_->diffuse(at.fine_normal).cast<float>();
      constexpr float kDarkest = 0.02f;  // of the light that is divided by
      color = color.cwiseQuotient(diffuse.cwiseMax(kDarkest));
    }
    for (int k = 0; k < 3; ++k) mesh_.color.at(x, y)[k] = srgb8_from_linear(color[k]);

    // As a viewer does it: both interpolated and made unit, the third from them.
    normal.normalize();
    tangent.normalize();
    const Eigen::Vector3d across = normal.cross(tangent);
    const double components[3] = {tangent.dot(at.fine_normal), across.dot(at.fine_normal),
                                  normal.dot(at.fine_normal)};
    for (int k = 0; k < 3; ++k)
      mesh_.normal_map.at(x, y)[k] = static_cast<std::uint8_t>(
          std::lround(std::clamp(0.5 * (components[k] + 1), 0.0, 1.0) * 255));
  }

  const FineSurface& fine_;
  const Lighting* light_;
  int side_;
  TexturedMesh& mesh_;
};

}  // namespace

FineSurface::FineSurface(const Bundle& bundle, TriangleMesh base)
    : base_(std::move(base)), normals_(vertex_normals(base_)), scene_(base_), maps_(bundle) {}

FineSurface::Appearance FineSurface::at(const Eigen::Vector3d& point) const {
  const ClosestPoint closest = scene_.closest_point(point);
  const auto [a, b, c] = base_.faces[closest.face];
  // Weights of the corners by areas, of a point that lies in the face.
  const Eigen::Vector3d e1 = base_.vertices[b] - base_.vertices[a],
                        e2 = base_.vertices[c] - base_.vertices[a],
                        d = closest.point - base_.vertices[a], n = e1.cross(e2);
  const double doubled = n.squaredNorm();
  const double w1 = doubled > 0 ? std::clamp(d.cross(e2).dot(n) / doubled, 0.0, 1.0) : 0;
  const double w2 = doubled > 0 ? std::clamp(e1.cross(d).dot(n) / doubled, 0.0, 1.0 - w1) : 0;
  const double w0 = 1 - w1 - w2;
  Appearance look;
  look.normal = (w0 * normals_[a] + w1 * normals_[b] + w2 * normals_[c]).normalized();
  look.fine_normal = look.normal;
  if (const auto sample = maps_.at(closest.point, look.normal)) {
    look.color = sample->color;
    look.fine_normal = sample->normal;
    return look;
  }
  look.color = static_cast<float>(w0) * base_.colors[a] + static_cast<float>(w1) * base_.colors[b] +
               static_cast<float>(w2) * base_.colors[c];
  return look;
}

void bake_atlas(const FineSurface& fine, const Lighting* light, int side, TexturedMesh& mesh) {
  AtlasBaker(fine, light, side, mesh).run();
}

}  // namespace organbake
