// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "measuring/player_bundles.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/core/text.h"
#include "organbake/evaluation/comparison_table.h"
#include "organbake/image/difference.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/orbit.h"
#include "organbake/warp/paper_warp.h"
#include "promises.h"
#include "report/error_pictures.h"

namespace organbake {
namespace {

constexpr double kWhite_levels = 48;  // of 255: most errors are edges of the texture

// The largest of a pixel's three differences, in levels of 8 bits. Both have one size.
Rgb8Image heat_map_of(const Rgb8Image& a, const Rgb8Image& b, double scale_levels) {
  std::vector<double> levels(a.pixels.size() / 3);
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    levels[i / 3] = std::max<double>(levels[i / 3], std::abs(a.pixels[i] - b.pixels[i]));
  return heat_map(levels, a.width, scale_levels);
}

struct PokedView {
  double angle_rad = 0, psnr_db = 0;
  Rgb8Image truth, ours, papers;
};

PokedView look(Player& player, const CarriedSurface& truth, double angle_rad, int side_px) {
  const View view = orbit_view(player.bundle().cameras, {angle_rad}, side_px, side_px);
  DrawOptions options;
  options.background = {0, 0, 0};
  PokedView seen{angle_rad,
                 0,
                 truth.draw(truth.carry(player.proxy_positions()), view, options.background).color,
                 {},
                 {}};
  Frame frame;
  player.draw(view, options, frame);
  seen.ours = frame.color;
  PaperWarp(player.bundle()).draw(player.bundle(), player.proxy_positions(), view, options, frame);
  seen.papers = frame.color;
  seen.psnr_db = compare_images(seen.ours, seen.truth).psnr_db;
  return seen;
}

// Truth, ours, our error and the error of the paper's own warp, black for none, for people to look
// at: the worst of five angles.
TEST(WorstPoke, IsNearerTheTruthThanThePapersWarp) {
  const TemporaryFolder scratch;
  PlayerBundles bundles(scratch.path(), {}, false);
  const CompareOptions table;  // the paper's angles, and how deep it is poked
  const auto folder = bundles.folder({80, "fitted", bundles.map_size()});
  Player player(folder, {}, true);
  const CarriedSurface truth(BundleReader(folder).read_surface(), player.bundle().shell());
  hold_poke(player, player.bundle().cameras.manifold.directions.front(), table.poke_share,
            player.bundle().mechanics.instrument_radius_mm);
  std::optional<PokedView> worst;
  for (const double angle : table.angles_rad) {
    PokedView seen = look(player, truth, angle, 400);
    if (!worst || seen.psnr_db < worst->psnr_db) worst = std::move(seen);
  }
  show(tile_pictures(
           {worst->truth, worst->ours, heat_map_of(worst->ours, worst->truth, kWhite_levels),
            heat_map_of(worst->papers, worst->truth, kWhite_levels)},
           4, 2),
       "truth, ours, its error, the paper's error");
  expect({"poked by " + to_text(100 * table.poke_share) + " %, the worst view, " +
              to_text(worst->angle_rad, 3) + " rad: PSNR beyond the paper's own warp",
          "dB", worst->psnr_db - compare_images(worst->papers, worst->truth).psnr_db, 0,
          Figure::Goal::at_least});
}

}  // namespace
}  // namespace organbake
