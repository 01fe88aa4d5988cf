// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle's maps as small pictures, and its proxy drawn over what the cameras see.
#include "organbake/pipelines/bake_report.h"

#include <algorithm>
#include <cmath>

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

// An SVG path of the faces that look at the camera, in the map's pixels times `scale`.
std::string face_path(const TriangleMesh& proxy, const PosedCamera& camera, double scale) {
  const Eigen::Vector3d eye = camera.center_world_mm();
  std::string path;
  for (std::size_t f = 0; f < proxy.faces.size(); ++f) {
    if (face_normal(proxy, f).dot(eye - proxy.vertices[proxy.faces[f][0]]) <= 0) continue;
    char command = 'M';
    for (const std::uint32_t v : proxy.faces[f]) {
      const Eigen::Vector2d pixel = scale * project(camera, proxy.vertices[v]);
      path += command + to_text(pixel.x(), 1) + " " + to_text(pixel.y(), 1);
      command = 'L';
    }
    path += 'Z';
  }
  return path;
}

// The proxy's edges as one camera sees them over its colour map: an inline SVG.
std::string proxy_over_surface(const Bundle& frame, const CameraMaps& maps, std::size_t camera) {
  constexpr int kSide = 440;
  const PosedCamera& posed = frame.cameras.cameras[camera];
  const Rgb8Image picture = reduced(maps, kSide, [&](std::size_t i) { return maps.color[i]; });
  const double scale = double(picture.width) / maps.width;
  const std::string width = std::to_string(picture.width), height = std::to_string(picture.height);
  return "<svg role=\"img\" aria-label=\"the proxy's edges over the surface, camera " +
         std::to_string(camera) + "\" width=\"" + width + "\" height=\"" + height +
         "\" viewBox=\"0 0 " + width + " " + height + "\"><image width=\"" + width +
         "\" height=\"" + height + "\" href=\"" + png_data_uri(picture) +
         "\"/><path fill=\"none\" stroke=\"#7df\" stroke-width=\"1.2\" stroke-linejoin=\"round\" "
         "d=\"" +
         face_path(frame.proxy, posed, scale) + "\"/></svg>";
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
