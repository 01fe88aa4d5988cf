// SPDX-License-Identifier: GPL-3.0-or-later

#include "measuring/scenes.h"
#include "organbake/decimate/decimate.h"
#include "organbake/evaluation/comparison_table.h"
#include "organbake/geometry/refine.h"
#include "organbake/image/difference.h"
#include "organbake/phantom/phantom.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/viewpoints/placement.h"
#include "promises.h"
#include "support/testing.h"

// A lobe before another one takes one sample a pixel, as the organ's own outline does.
namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kLobe_mm = 18, kGap_mm = 10;  // radius; between it and the organ

// The organ with pale lobes round it.
TriangleMesh organ_with_lobes(const OrganPhantom& phantom, int subdivisions) {
  TriangleMesh all = phantom.surface(subdivisions);
  const Vector3d middle = bounds(all).center();
  const std::size_t organ_vertices = all.vertices.size();
  for (const Vector3d& direction : {Vector3d(1, 0.2, 0.3), Vector3d(-0.3, 1, -0.4),
                                    Vector3d(0.2, -1, 0.5), Vector3d(-1, -0.4, 0.1)}) {
    const Vector3d out = direction.normalized();
    double reach = 0;
    for (std::size_t v = 0; v < organ_vertices; ++v) {
      const Vector3d from_middle = all.vertices[v] - middle;
      if (from_middle.normalized().dot(out) > 0.95) reach = std::max(reach, from_middle.dot(out));
    }
    const Vector3d center = middle + (reach + kGap_mm + kLobe_mm) * out;
    const TriangleMesh lobe = make_icosphere(subdivisions - 1);
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    for (const Vector3d& v : lobe.vertices) {
      all.vertices.push_back(center + kLobe_mm * v.normalized());
      const auto shade = static_cast<float>(0.8 + 0.2 * std::sin(9 * v.x()) * std::sin(7 * v.z()));
      all.colors.push_back(shade * Eigen::Vector3f(0.62F, 0.5F, 0.28F));
    }
    for (const auto& [a, b, c] : lobe.faces) all.faces.push_back({first + a, first + b, first + c});
  }
  return all;
}

// Where nearer skin ends before farther skin, by what the pixels' centres see of the truth, and a
// pixel more to each side; not where the background takes part.
std::vector<std::uint8_t> inner_outlines(const CarriedSurface& surface, const View& view,
                                         const TruthFrame& truth) {
  const std::vector<Vector3d>& positions = surface.at_rest().vertices;
  const auto seen = surface.seen_at_centers(positions, view);
  const int width = truth.color.width, height = truth.color.height;
  const auto at = [&](int x, int y) { return std::size_t(y) * width + x; };
  std::vector<double> depth_mm(seen.size(), 0);
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i].face != kNoFace)
      depth_mm[i] = (view.camera.camera_from_world * surface.point(seen[i], positions)).z();
  std::vector<std::uint8_t> band(seen.size(), 0);
  const auto mark = [&](int x, int y, int other_x, int other_y) {
    const double a = depth_mm[at(x, y)], b = depth_mm[at(other_x, other_y)];
    if (a == 0 || b == 0 || std::abs(a - b) < kGap_mm) return;
    for (const auto& [px, py] : {std::pair(x, y), {other_x, other_y}})
      for (int ny = py - 1; ny <= py + 1; ++ny)
        for (int nx = px - 1; nx <= px + 1; ++nx) band[at(nx, ny)] = 1;
  };
  for (int y = 1; y + 2 < height; ++y)
    for (int x = 1; x + 2 < width; ++x) mark(x, y, x + 1, y), mark(x, y, x, y + 1);
  for (std::size_t i = 0; i < band.size(); ++i)
    band[i] &= truth.covered[i] == TruthFrame::kRaysPerPixel;
  return band;
}

TEST(InnerOutlines, OfLobesAreSmooth) {
  const TriangleMesh surface = organ_with_lobes(OrganPhantom({}), 6);
  DecimateOptions decimating;
  decimating.faces = 600;
  PlacementOptions placement;
  placement.count = 8;
  placement.map_size = 1024;
  Player player(memory_bundle(surface, decimate(surface, decimating).proxy, placement));
  const CarriedSurface truth(surface, player.bundle().shell());
  DrawOptions options;
  options.light = DrawnLight::baked;
  options.background = {0, 0, 0};
  const int size_px = 720;
  double gain_db = 0, smooth_db = 0;
  int views = 0;
  for (const double angle_rad : CompareOptions().angles_rad) {
    const View view = orbit_view(player.bundle().cameras, {angle_rad}, size_px, size_px);
    const TruthFrame expected = truth.draw(surface.vertices, view, options.background);
    const std::vector<std::uint8_t> band = inner_outlines(truth, view, expected);
    constexpr std::ptrdiff_t kFewest = 200;  // pixels that tell anything
    if (std::count(band.begin(), band.end(), 1) < kFewest) continue;
    const auto error_db = [&](bool smooth) {
      options.smooth_outline = smooth;
      Frame frame;
      player.draw(view, options, frame);
      return compare_images(frame.color, expected.color, band).psnr_db;
    };
    const double smooth = error_db(true);
    smooth_db += smooth;
    gain_db += smooth - error_db(false);
    ++views;
  }
  const std::string scene = "lobes before an organ, two pixels to each side of their outlines, " +
                            std::to_string(views) + " views: PSNR against 16 rays a pixel, mean";
  expect({scene, "dB", smooth_db / std::max(1, views), 0, Figure::Goal::at_least});
  expect({scene + ", above one sample a pixel", "dB", gain_db / std::max(1, views), 4,
          Figure::Goal::at_least});
}

}  // namespace
}  // namespace organbake
