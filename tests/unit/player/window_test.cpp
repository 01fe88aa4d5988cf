// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/bundle_list.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/player/embedded_player.h"
#include "organbake/player/panel_layout.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

TEST(BundleList, HasBundlesFirstAndNoHiddenFoldersOrFiles) {
  const fs::path folder = fs::path(testing::TempDir()) / "bundle_list";
  fs::remove_all(folder);
  for (const char* name : {"b", "a", "z_bundle", "y_bundle", ".hidden"})
    fs::create_directories(folder / name);
  for (const char* name : {"z_bundle/manifest.json", "y_bundle/manifest.json", "file"})
    std::ofstream(folder / name) << "{}";
  std::string listed;
  for (const ListedFolder& f : list_folders(folder)) listed += f.name + (f.is_bundle ? "! " : " ");
  EXPECT_EQ(listed, "y_bundle! z_bundle! a b ");
  EXPECT_TRUE(list_folders(folder / "nowhere").empty());
  fs::remove_all(folder);
}

bool overlap(const PixelRect& a, const PixelRect& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

TEST(PanelLayout, FillsTheWindowWithoutAnyOverlap) {
  for (const Eigen::Vector2i& size :
       {Eigen::Vector2i(700, 450), {1280, 720}, {1920, 1080}, {3840, 2160}}) {
    for (int wanted = 0; wanted < 16; ++wanted) {
      const OpenPanels open{(wanted & 1) != 0, (wanted & 2) != 0, (wanted & 4) != 0};
      const double scale = panel_scale(size, 1);
      const PanelLayout l = lay_out_panels(size, scale, open, (wanted & 8) != 0);
      const std::vector<PixelRect> rects = {l.tools, l.readings, l.timeline, l.organ};
      int area = 0;
      for (std::size_t a = 0; a < rects.size(); ++a) {
        area += rects[a].width * rects[a].height;
        for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(overlap(rects[a], rects[b]));
      }
      EXPECT_EQ(area, size.prod());
      EXPECT_GE(l.organ.width, int(scale * kLeastOrgan_px));
      EXPECT_GE(l.organ.height, size.y() / 2);
    }
  }
}

TEST(PanelLayout, FoldsTheSideThatIsNotPreferredWhereBothDoNotFit) {
  for (const bool readings : {false, true}) {
    const OpenPanels open = lay_out_panels({700, 450}, 1, {}, readings).open;
    EXPECT_EQ(open, (OpenPanels{!readings, readings, true}));
    EXPECT_EQ(lay_out_panels({1280, 720}, 1, {}, readings).open, OpenPanels{});
  }
  EXPECT_EQ(lay_out_panels({400, 300}, 1, {}, false).open, (OpenPanels{false, false, true}));
}

TEST(PanelLayout, GrowsWithTheWindowOrAsTheScreenAsks) {
  EXPECT_EQ(panel_scale({1280, 720}, 1), 1);
  EXPECT_EQ(panel_scale({1280, 720}, 1.5), 1.5);
  EXPECT_EQ(panel_scale({3840, 2160}, 1), 2);
}

// What it does with a bundle is tested from outside: tests/cli/consumer.sh.
TEST(EmbeddedPlayer, AMissingBundleIsNamed) {
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle"), NoInputError);
}

TEST(EmbeddedPlayer, ABadTimeStepIsSaidBeforeTheBundleIsRead) {
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle", 0), UsageError);
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle", std::nan("")), UsageError);
}

}  // namespace
}  // namespace organbake
