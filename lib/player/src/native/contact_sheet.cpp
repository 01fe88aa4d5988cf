// SPDX-License-Identifier: Apache-2.0
// One picture that shows what an organ can do: it at rest, poked ever deeper, and from several
// sides, as tiles.
#include "organbake/player/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "organbake/core/error.h"
#include "organbake/player/held_tools.h"
#include "organbake/player/orbit.h"
#include "organbake/player/skin_point.h"

namespace organbake {
namespace {

Rgb8Image picture(Player& player, const OrbitPose& pose, int width, int height,
                  const DrawOptions& options, const SeenFrame& seen) {
  Frame frame;
  const View view = orbit_view(player.bundle().cameras, pose, width, height);
  player.draw(view, options, frame);
  return seen ? seen(frame, view) : frame.color;
}

// Three views from aside: all round, or as far to the sides and up as the virtual cameras reach
// where they see one side only, as those of a laparoscopy do.
std::array<OrbitPose, 3> side_poses(const ViewManifold& manifold) {
  constexpr double kAround = 1.3, kLeast = 0.5;
  double reach = kLeast;  // rad from camera 0
  for (const Eigen::Vector3d& d : manifold.directions)
    reach = std::max(reach, std::acos(std::clamp(manifold.directions.front().dot(d), -1.0, 1.0)));
  if (reach < kAround) return {OrbitPose{-reach, 0.1}, OrbitPose{reach, 0.1}, OrbitPose{0, reach}};
  return {OrbitPose{-kAround, 0.1}, OrbitPose{kAround, 0.1}, OrbitPose{std::numbers::pi, 0.1}};
}

}  // namespace

Rgb8Image tile_pictures(const std::vector<Rgb8Image>& pictures, int columns, int gap_px) {
  if (pictures.empty() || columns < 1) throw UsageError("a contact sheet needs pictures");
  const int w = pictures[0].width, h = pictures[0].height;
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  Rgb8Image sheet(columns * w + (columns + 1) * gap_px, rows * h + (rows + 1) * gap_px);
  std::fill(sheet.pixels.begin(), sheet.pixels.end(), std::uint8_t{48});
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const int x0 = gap_px + static_cast<int>(i % columns) * (w + gap_px);
    const int y0 = gap_px + static_cast<int>(i / columns) * (h + gap_px);
    for (int y = 0; y < h; ++y) {
      std::copy_n(pictures[i].at(0, y), 3 * w, sheet.at(x0, y0 + y));
    }
  }
  return sheet;
}

Instrument hold_poke(Player& player, const Eigen::Vector3d& direction, double share,
                     double radius_mm) {
  const Eigen::Vector3d outward = direction.normalized();
  const Eigen::Vector3d skin = skin_point(player.bundle(), outward);
  const double depth = share * thickness_mm(player.bundle(), outward);
  Instrument tip{skin, radius_mm, Ball{}, true};
  constexpr int kPressSteps = 60, kRestSteps = 240;  // a second in, four to come to rest
  for (int step = 0; step <= kPressSteps + kRestSteps; ++step) {
    const double way = std::min(1.0, double(step) / kPressSteps);
    tip.position_mm = skin + (radius_mm - way * depth) * outward;
    player.step({tip});
  }
  return tip;
}

Rgb8Image contact_sheet(Player& player, int tile_width, int tile_height, const DrawOptions& drawing,
                        const RunContext& context, const SeenFrame& seen) {
  const Bundle& bundle = player.bundle();
  const Eigen::Vector3d front = poke_direction(bundle);
  constexpr int kPictures = 8;
  std::vector<Rgb8Image> pictures;
  context.progress(0);
  HeldTools held(player);
  const auto add = [&](const OrbitPose& pose, const std::vector<Instrument>& tools) {
    context.throw_if_cancelled();
    DrawOptions options = drawing;
    options.solids =
        held.solids(tools, orbit_view(bundle.cameras, pose, tile_width, tile_height), 0);
    pictures.push_back(picture(player, pose, tile_width, tile_height, options, seen));
    context.progress(double(pictures.size()) / kPictures);
  };
  constexpr double kAside = 0.7;  // rad: sees the dent's profile and the tool's shaft
  player.reset();
  add({}, {});
  const double radius = bundle.mechanics.instrument_radius_mm;
  for (const double share : {0.08, 0.16, 0.3}) {
    player.reset();
    const auto tip = hold_poke(player, front, share, radius);
    add({kAside, 0.25}, {tip});
  }
  player.reset();
  for (const OrbitPose& pose : side_poses(bundle.cameras.manifold)) add(pose, {});
  const auto tip = hold_poke(player, front, 0.3, radius);
  add({0, 0.35}, {tip});
  player.reset();
  return tile_pictures(pictures, 4, 6);
}

}  // namespace organbake
