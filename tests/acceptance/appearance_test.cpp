// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <nlohmann/json.hpp>

#include "measuring/baker.h"
#include "measuring/scope_views.h"
#include "measuring/tissue_appearance.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/player/player.h"
#include "organbake/shading/video_reader.h"
#include "promises.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

// As the shared video shows its liver: by the gallbladder's width of about 25 mm.
constexpr double kFrame_mm_per_pixel = 0.15;

// Frames some seconds apart, where at least a tenth of the picture is liver.
std::vector<TissuePicture> real_pictures(const std::filesystem::path& video, std::size_t apart) {
  constexpr double kLeastShare = 0.1;
  std::vector<TissuePicture> pictures;
  VideoReader reader(video);
  StoredPicture frame;
  for (std::size_t number = 0; reader.next(frame); ++number) {
    if (number % apart != 0) continue;
    std::vector<std::uint8_t> mask = liver_mask(frame.color);
    const auto tissue = std::count(mask.begin(), mask.end(), std::uint8_t{1});
    if (static_cast<double>(tissue) < kLeastShare * static_cast<double>(mask.size())) continue;
    pictures.push_back({frame.color, std::move(mask), kFrame_mm_per_pixel});
  }
  return pictures;
}

// Views of a bundle as a scope has them that shows its skin in the frames' scale. Through a longer
// lens from farther away light and eye would lie nearly one way from all of the skin, and all that
// faces them would shine.
std::vector<TissuePicture> rendered_pictures(Player& player, DrawnLight light) {
  constexpr int kWidth_px = 1280;
  constexpr double kRange_mm = kFrame_mm_per_pixel * kScopeFocal_widths * kWidth_px;
  std::vector<TissuePicture> pictures;
  for (const Eigen::Vector3d& toward :
       {Eigen::Vector3d(-0.2, -1, 0.1), {0.5, -0.8, -0.3}, {-0.6, -0.7, 0.4}, {0.1, -0.9, 0.5}}) {
    DrawOptions options;
    options.light = light;
    Frame frame;
    const ScopeAim aim = scope_aim(player.bundle().proxy, toward);
    player.draw(scope_view(aim, kRange_mm, kWidth_px), options, frame);
    TissuePicture picture{frame.color, {}, kFrame_mm_per_pixel};
    for (const Cover cover : frame.cover) picture.mask.push_back(cover != Cover::background);
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

std::vector<TissueAppearance> appearances(const std::vector<TissuePicture>& pictures) {
  std::vector<TissueAppearance> found;
  for (const TissuePicture& picture : pictures) found.push_back(appearance_of(picture));
  return found;
}

// Every part, and their mean, the distance.
void add_distance(const std::string& what, const std::vector<TissueAppearancePart>& parts,
                  const std::vector<TissueAppearancePart>& real, double target) {
  constexpr double kMost = 5;
  const std::vector<TissueAppearancePart> times = in_real_differences(parts, real);
  for (const TissueAppearancePart& part : times)
    expect({what + ": " + part.name, "× two real frames", part.distance, kMost});
  expect({what, "× two real frames", mean_distance(times), target});
}

// As liver.yaml bakes it.
constexpr const char* kLiver =
    "schema: organbake/recipe/1\nname: liver\nisosurface: {smooth_mm: 1.5, largest: 1}\n"
    "decimate: {faces: 300}\nmechanics: {young_modulus_kpa: 10}\nplace: {count: 12}\n";

void measure_look(const std::string& look, const std::string& capture,
                  const std::vector<TissuePicture>& real, double target) {
  const TemporaryFolder folder;
  const std::filesystem::path bundle = folder.path() / "bundle";
  Baker(folder.path(), {}, kLiver + capture)
      .bake(bundle,
            {"--set", "ct=" + shared_data("ct/abdomen/example_ct.nii.gz").string(), "--set",
             "mask=" + shared_data("ct/abdomen/example_seg.nii.gz").string(), "--set", "label=5"});
  Player player(bundle);
  const std::vector<TissuePicture> rendered = rendered_pictures(player, player.default_light());
  const std::vector<TissueAppearance> of_real = appearances(real);
  add_distance("CT liver, " + look + ", against the video's liver",
               mean_parts(appearances(rendered), of_real), mean_parts(of_real, of_real), target);
  show(side_by_side(rendered.front().image, real.front().image),
       "CT liver, " + look + ", and a frame of the video");
}

TEST(Appearance, OfACtLiverIsNearThatOfTheVideo) {
  REQUIRE_SHARED_DATA("video/laparoscopy_720p_25fps.mp4");
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct.nii.gz");
  const auto real = real_pictures(shared_data("video/laparoscopy_720p_25fps.mp4"),
                                  static_cast<std::size_t>(cases(40, 20)));
  ASSERT_GE(real.size(), 2u) << "the video shows liver in less than two frames";
  measure_look("by its material", "capture: {material: liver}\n", real, 2);
  measure_look("plain", "capture: {albedo: [0.42, 0.13, 0.1]}\n", real, 5);
}

}  // namespace
}  // namespace organbake
