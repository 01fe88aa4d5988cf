// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle's maps as small pictures, and its proxy drawn over what the cameras see.
#include "organbake/pipelines/bake_report.h"

#include <algorithm>
#include <cmath>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/image/srgb.h"
#include "organbake/pipelines/documents.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

const Vector3f kGround = {0.008f, 0.009f, 0.012f};  // linear; behind the organ

int reduced_side(int side, int longer, int most) {
  return std::max(1, side * std::min(most, longer) / longer);
}

// Each pixel is the mean of `color_of` over the texels below it that show the organ, and takes the
// ground for those that don't.
template <class ColorOf>
Rgb8Image reduced(const CameraMaps& maps, int most, const ColorOf& color_of) {
  const int longer = std::max(maps.width, maps.height);
  Rgb8Image image(reduced_side(maps.width, longer, most), reduced_side(maps.height, longer, most));
  for (int y = 0; y < image.height; ++y) {
    const int top = y * maps.height / image.height, bottom = (y + 1) * maps.height / image.height;
    for (int x = 0; x < image.width; ++x) {
      const int left = x * maps.width / image.width, right = (x + 1) * maps.width / image.width;
      Vector3f sum = Vector3f::Zero();
      for (int row = top; row < bottom; ++row) {
        for (int column = left; column < right; ++column) {
          const std::size_t texel = std::size_t(row) * maps.width + column;
          sum += maps.face[texel] == kNoFace ? kGround : color_of(texel);
        }
      }
      const Vector3f mean = sum / static_cast<float>((bottom - top) * (right - left));
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = srgb8_from_linear(mean[c]);
    }
  }
  return image;
}

TexelRange range_of(const std::vector<float>& values, const CameraMaps& maps) {
  TexelRange range{HUGE_VAL, -HUGE_VAL};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (maps.face[i] == kNoFace) continue;
    range.least = std::min<double>(range.least, values[i]);
    range.most = std::max<double>(range.most, values[i]);
  }
  return range.least > range.most ? TexelRange{} : range;
}

// White at 0, red up to +1, blue down to −1; beyond them no redder.
Vector3f height_color(double share) {
  const auto strength = static_cast<float>(std::clamp(std::abs(share), 0.0, 1.0));
  const Vector3f white = {0.9f, 0.9f, 0.9f};
  const Vector3f full = share > 0 ? Vector3f(0.6f, 0.02f, 0.02f) : Vector3f(0.02f, 0.08f, 0.6f);
  return white + strength * (full - white);
}

// A camera's height map decides how strong its colours are, so it is asked before any is drawn:
// the base layer, which all share, tells it without reading them all.
double height_limit(const BaseLayer& base) {
  double limit = 0;
  for (const float height : base.height_mm) limit = std::max<double>(limit, std::abs(height));
  return limit > 0 ? limit : 1;
}

std::size_t most_opposite(const CameraSet& set) {
  const Eigen::Vector3d first = set.cameras.front().view_direction_world();
  const auto least = std::min_element(
      set.cameras.begin(), set.cameras.end(), [&](const PosedCamera& a, const PosedCamera& b) {
        return a.view_direction_world().dot(first) < b.view_direction_world().dot(first);
      });
  return static_cast<std::size_t>(least - set.cameras.begin());
}

// Whether the surface lies in front of a point: it may by the proxy's own error, no more.
class Hiding {
 public:
  Hiding(const PosedCamera& camera, const CameraMaps& maps, double margin_mm)
      : camera_(camera), maps_(maps), margin_mm_(margin_mm) {}

  bool shows(const Eigen::Vector3d& point_world_mm) const {
    const Eigen::Vector3d point = camera_.camera_from_world * point_world_mm;
    if (!(point.z() > 0)) return false;
    const Eigen::Vector2d pixel = project(camera_.intrinsics, point);
    if (!(pixel.x() >= 0 && pixel.x() < maps_.width && pixel.y() >= 0 && pixel.y() < maps_.height))
      return false;
    const std::size_t texel = std::size_t(pixel.y()) * maps_.width + std::size_t(pixel.x());
    return point.z() <= maps_.depth_mm[texel] + margin_mm_;
  }

 private:
  const PosedCamera& camera_;
  const CameraMaps& maps_;
  double margin_mm_;
};

std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_facing(const TriangleMesh& proxy,
                                                                  const Eigen::Vector3d& eye) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::size_t f = 0; f < proxy.faces.size(); ++f) {
    const auto& [a, b, c] = proxy.faces[f];
    if (face_normal(proxy, f).dot(eye - proxy.vertices[a]) <= 0) continue;
    for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}})
      edges.emplace_back(std::min(from, to), std::max(from, to));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// An SVG path of the parts of the edges that show, in the map's pixels times `scale`.
std::string edge_path(const TriangleMesh& proxy, const PosedCamera& camera, const Hiding& hiding,
                      double scale) {
  constexpr int kPieces = 12;  // of an edge; each is drawn when its middle shows
  std::string path;
  const auto append = [&](char command, const Eigen::Vector3d& point) {
    const Eigen::Vector2d pixel = scale * project(camera, point);
    path += command + to_text(pixel.x(), 1) + " " + to_text(pixel.y(), 1);
  };
  for (const auto& [a, b] : edges_facing(proxy, camera.center_world_mm())) {
    const Eigen::Vector3d from = proxy.vertices[a], along = proxy.vertices[b] - from;
    bool drawing = false;
    for (int i = 0; i < kPieces; ++i) {
      const bool shows = hiding.shows(from + (i + 0.5) / kPieces * along);
      if (shows && !drawing) append('M', from + double(i) / kPieces * along);
      if (shows) append('L', from + (i + 1.0) / kPieces * along);
      drawing = shows;
    }
  }
  return path;
}

// The proxy's edges as one camera sees them over its colour map: an inline SVG. What the surface
// hides from the camera is not drawn.
std::string proxy_over_surface(const Bundle& frame, const CameraMaps& maps, std::size_t camera) {
  constexpr int kSide = 440;
  const PosedCamera& posed = frame.cameras.cameras[camera];
  const Rgb8Image picture = reduced(maps, kSide, [&](std::size_t i) { return maps.color[i]; });
  const double scale = double(picture.width) / maps.width;
  const Hiding hiding(posed, maps, 2 * height_limit(frame.base));
  const std::string width = std::to_string(picture.width), height = std::to_string(picture.height);
  return "<svg role=\"img\" aria-label=\"the proxy's edges over the surface, camera " +
         std::to_string(camera) + "\" width=\"" + width + "\" height=\"" + height +
         "\" viewBox=\"0 0 " + width + " " + height + "\"><image width=\"" + width +
         "\" height=\"" + height + "\" href=\"" + png_data_uri(picture) +
         "\"/><path fill=\"none\" stroke=\"#7df\" stroke-width=\"1.2\" stroke-linejoin=\"round\" "
         "d=\"" +
         edge_path(frame.proxy, posed, hiding, scale) + "\"/></svg>";
}

}  // namespace

MapThumbnails map_thumbnails(const CameraMaps& maps, double height_limit_mm) {
  MapThumbnails small;
  small.depth_mm = range_of(maps.depth_mm, maps);
  small.height_mm = range_of(maps.height_mm, maps);
  const auto filled = std::count_if(maps.face.begin(), maps.face.end(),
                                    [](std::uint32_t face) { return face != kNoFace; });
  small.filled_share = static_cast<double>(filled) / static_cast<double>(maps.face.size());
  const double span = std::max(small.depth_mm.most - small.depth_mm.least, 1e-12);
  small.color = reduced(maps, kThumbnailSide, [&](std::size_t i) { return maps.color[i]; });
  small.depth = reduced(maps, kThumbnailSide, [&](std::size_t i) -> Vector3f {
    constexpr float kDarkest = 0.03f, kLightest = 0.9f;
    const auto far = static_cast<float>((maps.depth_mm[i] - small.depth_mm.least) / span);
    return Vector3f::Constant(kLightest + far * (kDarkest - kLightest));
  });
  small.micro = reduced(maps, kThumbnailSide, [&](std::size_t i) {
    return height_color(maps.height_mm[i] / height_limit_mm);
  });
  return small;
}

BundlePictures bundle_pictures(const BundleReader& reader, const Bundle& frame) {
  BundlePictures pictures;
  pictures.height_limit_mm = height_limit(frame.base);
  pictures.proxy_cameras = {0};
  if (const std::size_t opposite = most_opposite(frame.cameras); opposite != 0)
    pictures.proxy_cameras.push_back(opposite);
  pictures.proxies_svg.resize(pictures.proxy_cameras.size());
  pictures.thumbnails.resize(frame.cameras.cameras.size());
  parallel_for(std::size_t{0}, frame.cameras.cameras.size(), [&](std::size_t c) {
    const CameraMaps maps =
        reader.read_maps(c, frame.cameras.cameras[c].intrinsics, shell_face_count(frame));
    pictures.thumbnails[c] = map_thumbnails(maps, pictures.height_limit_mm);
    for (std::size_t i = 0; i < pictures.proxy_cameras.size(); ++i) {
      if (pictures.proxy_cameras[i] == c)
        pictures.proxies_svg[i] = proxy_over_surface(frame, maps, c);
    }
  });
  return pictures;
}

}  // namespace organbake
