// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <numeric>

#include "bench.h"
#include "measuring/programs.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/warp/warper.h"

namespace organbake {
namespace {

constexpr int kStill = 1000;  // times as many when nothing changes: one alone is too short to time

// The part of the skin's area that these positions of the proxy's vertices move: the faces of what
// moves, and those round them, whose normals turn.
double moved_share(const ShellSurface& shell, const std::vector<Eigen::Vector3d>& positions) {
  const TriangleMesh& skin = shell.at_rest();
  std::vector<Eigen::Vector3d> posed;
  shell.pose(positions, posed);
  const auto moves = [&](auto v) { return posed[v] != skin.vertices[v]; };
  std::vector<bool> turned(posed.size(), false);
  for (const Face& face : skin.faces) {
    const bool touched = std::any_of(face.begin(), face.end(), moves);
    for (const auto v : face) turned[v] = turned[v] || touched;
  }
  double moved_mm2 = 0;
  for (std::size_t f = 0; f < skin.faces.size(); ++f) {
    const Face& face = skin.faces[f];
    if (std::any_of(face.begin(), face.end(), [&](auto v) { return turned[v]; }))
      moved_mm2 += face_area(skin, f);
  }
  return moved_mm2 / surface_area(skin);
}

// A round dent where the proxy is nearest to camera 0: as wide as a share of the surface allows,
// one vertex at least.
struct Dent {
  Eigen::Vector3d front;
  std::vector<bool> vertices;
  double share = 0;  // of the surface, that it moves

  Dent(const Bundle& bundle, double most) : front(bundle.cameras.manifold.directions.front()) {
    const ShellSurface shell = bundle.shell();
    const auto& at_rest = bundle.proxy.vertices;
    const Eigen::Vector3d foremost = *std::max_element(
        at_rest.begin(), at_rest.end(),
        [&](const auto& a, const auto& b) { return a.dot(front) < b.dot(front); });
    std::vector<std::size_t> order(at_rest.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return (at_rest[a] - foremost).norm() < (at_rest[b] - foremost).norm();
    });
    vertices.assign(at_rest.size(), false);
    for (const std::size_t v : order) {
      vertices[v] = true;
      const double wider = moved_share(shell, positions(bundle, 1));
      if (wider > most && v != order.front()) {
        vertices[v] = false;
        return;
      }
      share = wider;
    }
  }

  std::vector<Eigen::Vector3d> positions(const Bundle& bundle, double depth_mm) const {
    auto positions = bundle.proxy.vertices;
    for (std::size_t v = 0; v < positions.size(); ++v)
      if (vertices[v]) positions[v] -= depth_mm * front;
    return positions;
  }
};

// Frames in which the dent moves to and fro.
std::function<void()> moving(Warper& warper, const Bundle& bundle, const View& view,
                             const Dent& dent, const DrawOptions& options, Frame& frame) {
  return [&warper, &view, options, &frame,
          poses = std::array{dent.positions(bundle, 1), dent.positions(bundle, 2)}] {
    for (int i = 0; i < kFrames; ++i) warper.draw(poses[i % 2], view, options, frame);
  };
}

// With the light at the scope and the finish of a liver.
Bundle wet_bundle(PlayerBundles& bundles, int faces) {
  Bundle bundle = BundleReader(bundles.folder({faces, "fitted", bundles.map_size()})).read_all();
  Material liver;
  liver.tissue = Tissue::liver;
  const Lighting wet = liver.lighting();
  bundle.lighting->scope = wet.scope, bundle.lighting->finish = wet.finish;
  bundle.lighting->gloss = wet.gloss;
  return bundle;
}

DrawOptions in(DrawnLight light) {
  DrawOptions options;
  options.light = light;
  return options;
}

// A poke that moves a tenth of the surface, against one that moves all of it; then nothing moves.
void promise_partial_frames(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  const ThreadLimit one_thread(1);
  for (const int faces : {1000, 80}) {
    bench.now("a poke on a tenth of the surface, " + std::to_string(faces) + " faces");
    const Bundle bundle = wet_bundle(bundles, faces);
    Warper warper(bundle);
    const View view = view_at(bundle, size, 0);
    Frame frame;
    const Dent tenth(bundle, 0.1), all(bundle, 1);
    const std::string scene = size.name() + ", " + std::to_string(faces) + " faces: ";
    for (const auto& [light, least] :
         {std::pair(DrawnLight::baked, 1.4), std::pair(DrawnLight::scope, 1.6)}) {
      const auto timings = bench.time(
          std::vector<std::function<void()>>{moving(warper, bundle, view, tenth, in(light), frame),
                                             moving(warper, bundle, view, all, in(light), frame)});
      bench.at_least(scene + "all moves / " + to_text(100 * tenth.share, 2) +
                         " % of the skin moves, CPU time, " +
                         (light == DrawnLight::scope ? "lit by the scope" : "baked light"),
                     "×", ms_of(timings[1]) / ms_of(timings[0]), faces == 1000 ? least : 1);
    }
    const Timing still = bench.time([&] {
      for (int i = 0; i < kStill * kFrames; ++i)
        warper.draw(bundle.proxy.vertices, view, {}, frame);
    });
    bench.at_most(scene + "an unchanged frame, CPU time", "ms", ms_of(still) / kStill, 0.05);
  }
}

// What light costs where all skin moves: kept as it was baked, made anew, and from the scope.
void time_light(Bench& bench, PlayerBundles& bundles, const FrameSize& size) {
  bench.now("skin lit anew");
  const ThreadLimit one_thread(1);
  const Bundle bundle = wet_bundle(bundles, 80);
  Warper warper(bundle);
  const View view = view_at(bundle, size, 0);
  Frame frame;
  const Dent all(bundle, 1);
  std::vector<std::function<void()>> lights;
  for (const DrawnLight light : {DrawnLight::baked, DrawnLight::world, DrawnLight::scope})
    lights.push_back(moving(warper, bundle, view, all, in(light), frame));
  const auto timings = bench.time(lights);
  const char* const names[] = {"organplay, the light that was baked", "organplay, lit anew",
                               "organplay, lit by the scope, wet"};
  for (int i = 0; i < 3; ++i)
    bench.point(size.name() + ", one thread, all skin moves", names[i], of_one(timings[i], kFrames),
                {}, {{"maps", "px", double(bundles.map_size())}});
  bench.at_most(size.name() + ", all skin moves: lit by the scope / the light that was baked", "×",
                ms_of(timings[2]) / ms_of(timings[0]), 1.4);
}

void promise_motion(Bench& bench) {
  PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
  const FrameSize hd{1280, 720};
  time_light(bench, bundles, hd);
  promise_partial_frames(bench, bundles, hd);
}

const RegisteredPart kPlayerMotion("player", promise_motion);

}  // namespace
}  // namespace organbake
