// SPDX-License-Identifier: GPL-3.0-or-later
#include "error_measures.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "suites/skip_parts.h"

namespace organbake {
namespace {

// One of the vertices, pushed in by a little more for each frame.
std::vector<Eigen::Vector3d> pressed(const std::vector<Eigen::Vector3d>& rest, int frame) {
  std::vector<Eigen::Vector3d> positions = rest;
  positions[0] *= 1 - 0.002 * (frame + 1);
  return positions;
}

}  // namespace

void skip_frames(Bench& bench, const std::filesystem::path& bundle_folder) {
  const Bundle bundle = BundleReader(bundle_folder).read_all();
  const View view = orbit_view(bundle.cameras, {0.3, 0.1}, 1280, 720);
  const std::vector<Eigen::Vector3d>& rest = bundle.proxy.vertices;
  Warper whole_warper(bundle), warper(bundle);
  Frame whole, skipping;
  const auto draw = [&](Warper& by, const std::vector<Eigen::Vector3d>& positions, Frame& frame) {
    return by.draw(positions, view, {}, frame);
  };
  const auto anew = [&](const std::vector<Eigen::Vector3d>& positions) {
    whole.serial = 0;  // its last picture is not to be built on
    return draw(whole_warper, positions, whole);
  };
  const auto different = [&] { return count_different(whole.color.pixels, skipping.color.pixels); };
  draw(warper, rest, skipping);
  const double still =
      add_skip_scene(bench, {"a frame of 720p that is like the last one", [&] { anew(rest); },
                             [&] { draw(warper, rest, skipping); }, different});
  using enum Figure::Goal;
  bench.add(Figure{"an unchanged frame: everything / skipping", "×", still, 30, at_least});

  int frame_of_whole = 0, frame_of_skipping = 0;
  const double moved = add_skip_scene(
      bench, {"a frame of 720p in which one vertex of the proxy moved",
              [&] { anew(pressed(rest, frame_of_whole++)); },
              [&] { draw(warper, pressed(rest, frame_of_skipping++), skipping); }, different});
  bench.add(Figure{"one vertex moved: everything / skipping", "×", moved, 1, at_least});

  const DrawReport report = anew(rest);
  const double away = double(report.samples_facing_away);
  bench.add(Figure{
      "samples of the active cameras skipped in whole chunks, facing away", "%",
      100 * away / (away + double(report.samples_drawn) + double(report.samples_outside_view)), 0,
      at_least});
}

}  // namespace organbake
