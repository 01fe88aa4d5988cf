// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "color_flood.h"
#include "organbake/capture/photo_view.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Below this sum of weights (a good photo alone has about 1) the carried colours take over.
constexpr float kFaintWeight = 0.004f;
// From this on, a vertex counts as seen and colours are carried from it.
constexpr float kSeenWeight = 0.02f;

struct Blend {
  Vector3f sum = Vector3f::Zero();
  float weight = 0;
};

float brightness(const Vector3f& color) { return luminance(color[0], color[1], color[2]); }

// Highlights move with the photographer, the colour below does not: a photo brighter than the
// others' (power) mean counts less, down to a tenth. The mean leans to the dark, and the floor
// keeps one wrong dark pixel from taking over. Continuous in weights and colours.
Blend blend(const std::vector<PhotoView::Look>& looks) {
  constexpr float kBrighter = 0.1f;  // by this share of the mean: counts half
  constexpr float kFloor = 0.1f;
  constexpr float kBlack = 0.002f;
  float weights = 0, inverse_squares = 0;
  for (const auto& look : looks) {
    const float bright = brightness(look.color) + kBlack;
    weights += look.weight;
    inverse_squares += look.weight / (bright * bright);
  }
  Blend result;
  if (!(weights > 0)) return result;
  const float mean = std::sqrt(weights / inverse_squares);
  for (const auto& look : looks) {
    const float excess =
        std::max(0.0f, brightness(look.color) + kBlack - mean) / (kBrighter * mean);
    const float weight = look.weight * (kFloor + (1 - kFloor) / (1 + excess * excess));
    result.sum += weight * look.color;
    result.weight += weight;
  }
  return result;
}

class PhotoColor : public SurfaceColor {
 public:
  PhotoColor(const TriangleMesh& surface, const RayScene& scene, std::vector<Photo> photos)
      : faces_(surface.faces) {
    const SmoothNormals normals(surface);
    const Vector3d center = bounds(surface).center();
    for (Photo& photo : photos) views_.emplace_back(std::move(photo), scene, normals, center);
    carry_colors(surface, normals);
  }

  void shade(const std::vector<Vector3d>& points, const std::vector<Vector3d>& normals,
             const std::vector<RayHit>& hits, std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    std::vector<PhotoView::Look> looks;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Blend photos = blend_photos(points[i], normals[i], looks);
      colors[i] = (photos.sum + kFaintWeight * carried(hits[i])) / (photos.weight + kFaintWeight);
    }
  }

 private:
  // `looks` is scratch, the caller's so that it is allocated once.
  Blend blend_photos(const Vector3d& point, const Vector3d& normal,
                     std::vector<PhotoView::Look>& looks) const {
    looks.clear();
    for (const PhotoView& view : views_) {
      const PhotoView::Look look = view.look_at_point(point, normal);
      if (look.weight > 0) looks.push_back(look);
    }
    return blend(looks);
  }

  Vector3f carried(const RayHit& hit) const {
    const auto& [a, b, c] = faces_[hit.face];
    const float u = hit.u, v = hit.v;
    return (1 - u - v) * carried_[a] + u * carried_[b] + v * carried_[c];
  }

  // A large face may be seen although no corner is (corners sit on outlines), so a corner takes
  // part of what the photos see inside its faces.
  void carry_colors(const TriangleMesh& surface, const SmoothNormals& normals) {
    std::vector<Blend> in_face(surface.faces.size()), at_vertex(surface.vertices.size());
    constexpr std::size_t kFacesAtOnce = 256;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, surface.faces.size(), kFacesAtOnce),
                      [&](const auto& range) {
                        std::vector<PhotoView::Look> looks;
                        for (auto f = range.begin(); f != range.end(); ++f) {
                          RayHit middle;
                          middle.face = static_cast<std::uint32_t>(f);
                          middle.u = middle.v = 1.0f / 3;
                          in_face[f] =
                              blend_photos(normals.point(middle), normals.at(middle), looks);
                        }
                      });
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
      for (const std::uint32_t v : surface.faces[f]) {
        at_vertex[v].sum += in_face[f].sum;
        at_vertex[v].weight += in_face[f].weight;
      }
    std::vector<char> known(surface.vertices.size(), 0);
    carried_.assign(surface.vertices.size(), Vector3f::Zero());
    for (std::size_t v = 0; v < known.size(); ++v) {
      if (at_vertex[v].weight < kSeenWeight) continue;
      known[v] = 1;
      carried_[v] = at_vertex[v].sum / at_vertex[v].weight;
    }
    flood_colors(surface, known, carried_);
  }

  std::vector<Face> faces_;
  std::vector<PhotoView> views_;
  std::vector<Vector3f> carried_;  // by vertex
};

}  // namespace

std::unique_ptr<SurfaceColor> make_photo_color(const TriangleMesh& surface, const RayScene& scene,
                                               std::vector<Photo> photos) {
  check_mesh(surface, "surface");
  if (photos.empty())
    throw BadDataError("photos: none given; give at least one, or colour by vertex or material");
  return std::make_unique<PhotoColor>(surface, scene, std::move(photos));
}

}  // namespace organbake
