// SPDX-License-Identifier: Apache-2.0
// One picture that shows what an organ can do: it at rest, poked ever deeper, and from several
// sides, as tiles.
#include "organbake/player/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/player/held_tools.h"

namespace organbake {
namespace {

Rgb8Image picture(Player& player, const OrbitPose& pose, int width, int height,
                  const DrawOptions& options, const SeenFrame& seen) {
  Frame frame;
  const View view = orbit_view(player.bundle().cameras, pose, width, height);
  player.draw(view, options, frame);
  return seen ? seen(frame, view) : frame.color;
}

constexpr double kAround_rad = 1.3;  // cameras that reach so far see an organ from all sides

// How far the virtual cameras reach from the first, rad: those of a laparoscopy see one side only.
double reach_rad(const ViewManifold& manifold) {
  constexpr double kLeast = 0.15;  // of a single camera
  double reach = kLeast;
  for (const Eigen::Vector3d& d : manifold.directions)
    reach = std::max(reach, std::acos(std::clamp(manifold.directions.front().dot(d), -1.0, 1.0)));
  return reach;
}

// Three views from aside: all round, or as far to the sides and up as the cameras reach.
std::array<OrbitPose, 3> side_poses(double reach) {
  if (reach < kAround_rad)
    return {OrbitPose{-reach, 0.2 * reach}, OrbitPose{reach, 0.2 * reach}, OrbitPose{0, reach}};
  return {OrbitPose{-kAround_rad, 0.1}, OrbitPose{kAround_rad, 0.1},
          OrbitPose{std::numbers::pi, 0.1}};
}

// Letters of strokes, for what stands below a picture. Each is a list of lines, each line a list
// of places: a column 0 to 6 and a row, 0 the highest letters' top, 2 the low ones', 6 their foot.
constexpr std::pair<char, std::string_view> kStrokes[] = {
    {'0', "10 30 41 45 36 16 05 01 10"},
    {'1', "01 20 26"},
    {'2', "01 10 30 41 42 06 46"},
    {'3', "01 10 30 41 42 33 13,33 44 45 36 16 05"},
    {'4', "36 30 04 44"},
    {'5', "40 00 03 33 44 45 36 16 05"},
    {'6', "30 10 02 05 16 36 45 44 33 13 04"},
    {'7', "00 40 16"},
    {'8', "13 02 01 10 30 41 42 33 13 04 05 16 36 45 44 33"},
    {'9', "42 33 13 02 01 10 30 41 44 36 16"},
    {'N', "06 00 46 40"},
    {'a', "43 32 12 03 05 16 36 45,42 46"},
    {'c', "43 32 12 03 05 16 36 45"},
    {'d', "40 46,43 32 12 03 05 16 36 45"},
    {'e', "04 44 43 32 12 03 05 16 36 45"},
    {'f', "30 20 11 16,02 32"},
    {'g', "43 32 12 03 05 16 36 45,42 47 38 18 07"},
    {'h', "00 06,03 12 32 43 46"},
    {'i', "02 06,00 00"},
    {'m', "02 06,03 12 22 33 36,33 42 52 63 66"},
    {'n', "02 06,03 12 32 43 46"},
    {'o', "12 32 43 45 36 16 05 03 12"},
    {'p', "02 08,03 12 32 43 45 36 16 05"},
    {'r', "02 06,04 12 32"},
    {'s', "42 12 03 14 34 45 36 06"},
    {'t', "10 15 26 36,02 32"},
    {'.', "06 06"},
};

std::string_view strokes_of(char letter) {
  for (const auto& [name, strokes] : kStrokes)
    if (name == letter) return strokes;
  return {};
}

// Written from a corner on, in light letters on a darkened strip.
class Caption {
 public:
  Caption(Rgb8Image& picture, const Eigen::Vector2d& corner_px, double unit_px)
      : picture_(picture), at_(corner_px), unit_px_(unit_px) {
    constexpr double kAbove = 4, kDarkened = 0.3;  // letters' units; of the picture's light
    const int first = std::clamp(int(corner_px.y() - kAbove * unit_px), 0, picture.height);
    for (std::uint8_t* p = picture.at(0, first); p != &picture.pixels.back() + 1; ++p)
      *p = static_cast<std::uint8_t>(kDarkened * *p);
  }

  void write(std::string_view text) {
    for (const char letter : text) {
      double right = letter == ' ' ? 2 : 0;
      std::optional<Eigen::Vector2d> last;
      const std::string_view strokes = strokes_of(letter);
      for (std::size_t i = 0; i + 1 < strokes.size(); i += 3) {
        const Eigen::Vector2d place(strokes[i] - '0', strokes[i + 1] - '0');
        right = std::max(right, place.x());
        if (last) line(at_ + unit_px_ * *last, at_ + unit_px_ * place);
        last = place;
        if (i + 2 < strokes.size() && strokes[i + 2] == ',') last.reset();
      }
      at_.x() += unit_px_ * (right + 2);
    }
  }

 private:
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    const double half = 0.45 * unit_px_, reach = half + 1;
    const Eigen::Vector2d low = from.cwiseMin(to).array() - reach;
    const Eigen::Vector2d high = from.cwiseMax(to).array() + reach;
    const Eigen::Vector2d along = to - from;
    for (int y = std::max(0, int(low.y())); y <= std::min(picture_.height - 1, int(high.y())); ++y)
      for (int x = std::max(0, int(low.x())); x <= std::min(picture_.width - 1, int(high.x()));
           ++x) {
        const Eigen::Vector2d off = Eigen::Vector2d(x + 0.5, y + 0.5) - from;
        const double share =
            along.isZero(0) ? 0 : std::clamp(off.dot(along) / along.squaredNorm(), 0.0, 1.0);
        const double covered = std::clamp(half + 0.5 - (off - share * along).norm(), 0.0, 1.0);
        std::uint8_t* const rgb = picture_.at(x, y);
        constexpr double kLight = 225;
        for (int c = 0; c < 3; ++c)
          rgb[c] = std::max(rgb[c], static_cast<std::uint8_t>(covered * kLight));
      }
  }

  Rgb8Image& picture_;
  Eigen::Vector2d at_;
  double unit_px_;
};

// A share of the thickness; a tip goes no deeper than a view can follow it.
double depth_at(const PokeSite& site, double share, double radius_mm) {
  constexpr double kMostRadii = 10;  // by share
  return share * std::min(site.thickness_mm, kMostRadii * radius_mm);
}

std::string caption_of(const HeldPoke& poke) {
  return "depth " + to_text(poke.depth_mm, 1) + " mm   force " + to_text(poke.force_n, 2) + " N";
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

HeldPoke hold_poke(Player& player, const PokeSite& site, double depth_mm, double radius_mm) {
  HeldPoke poke{{site.skin_mm, radius_mm, Ball{}, true}, depth_mm};
  constexpr int kPressSteps = 60, kRestSteps = 240;  // a second in, four to come to rest
  for (int step = 0; step <= kPressSteps + kRestSteps; ++step) {
    const double way = std::min(1.0, double(step) / kPressSteps);
    poke.tip.position_mm = site.skin_mm + (radius_mm - way * depth_mm) * site.outward;
    poke.force_n = player.step({poke.tip}).tip_force_n[0].norm();
  }
  return poke;
}

Instrument hold_poke(Player& player, const Eigen::Vector3d& direction, double share,
                     double radius_mm) {
  const Eigen::Vector3d outward = direction.normalized();
  const double thick_mm = thickness_mm(player.bundle(), outward);
  return hold_poke(player, {skin_place(player.bundle(), outward).skin_mm, outward, thick_mm},
                   share * thick_mm, radius_mm)
      .tip;
}

OrbitPose close_up(const CameraSet& cameras, OrbitPose pose, const Eigen::Vector3d& place_mm) {
  constexpr double kNear = 0.6;
  pose.distance *= kNear;
  const Eigen::Vector3d at = orbit_view(cameras, pose, 1, 1).camera.camera_from_world * place_mm;
  const double unit_mm =
      (cameras.cameras.front().center_world_mm() - cameras.manifold.center_world_mm).norm();
  pose.right += at.x() / unit_mm, pose.up -= at.y() / unit_mm;
  return pose;
}

Rgb8Image contact_sheet(Player& player, int tile_width, int tile_height, const DrawOptions& drawing,
                        const RunContext& context, const SeenFrame& seen) {
  const Bundle& bundle = player.bundle();
  constexpr int kPictures = 8;
  std::vector<Rgb8Image> pictures;
  context.progress(0);
  const auto add = [&](const OrbitPose& pose, const std::vector<Instrument>& tools) {
    context.throw_if_cancelled();
    DrawOptions options = drawing;
    options.solids = HeldTools(player).solids(
        tools, orbit_view(bundle.cameras, pose, tile_width, tile_height), 0);
    pictures.push_back(picture(player, pose, tile_width, tile_height, options, seen));
    context.progress(double(pictures.size()) / kPictures);
  };
  const auto write_below = [&](const std::string& text) {
    const double unit_px = tile_height / 160.0;
    Caption(pictures.back(), {6 * unit_px, tile_height - 14 * unit_px}, unit_px).write(text);
  };
  const double radius = bundle.mechanics.instrument_radius_mm;
  const auto add_poke = [&](const OrbitPose& pose, double share) {
    const PokeSite site =
        poke_site(bundle, orbit_view(bundle.cameras, pose, tile_width, tile_height), radius);
    player.reset();
    const HeldPoke poke = hold_poke(player, site, depth_at(site, share, radius), radius);
    add(close_up(bundle.cameras, pose, site.skin_mm), {poke.tip});
    write_below(caption_of(poke));
  };
  const double reach = reach_rad(bundle.cameras.manifold);
  const std::string reach_deg = to_text(reach * 180 / std::numbers::pi, 0);
  if (reach < kAround_rad)
    context.info("sheet: its cameras see one side; views go " + reach_deg +
                 " degrees aside, as far as they do");
  player.reset();
  add({}, {});
  const double aside = std::min(0.35, 0.5 * reach);
  for (const double share : {0.08, 0.16, 0.3}) add_poke({aside, 0.5 * aside}, share);
  player.reset();
  for (const OrbitPose& pose : side_poses(reach)) {
    add(pose, {});
    if (reach < kAround_rad) write_below("seen to " + reach_deg + " deg aside");
  }
  add_poke({-aside, 0.5 * aside}, 0.3);
  player.reset();
  return tile_pictures(pictures, 4, 6);
}

}  // namespace organbake
