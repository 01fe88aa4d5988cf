// SPDX-License-Identifier: GPL-3.0-or-later
// How tissue looks by the light at the scope, beside real frames, and whether that look crawls.
#include "tissue_appearance.h"

#include "measuring/programs.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/evaluation/comparison_table.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/srgb.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
#include "organbake/shading/frame_source.h"
#include "organbake/warp/view.h"
#include "promises.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// A scope of 70° across, of pictures of 16 : 9.
inline constexpr double kScopeFocal_widths = 914.0 / 1280;

// The skin that a scope is held toward: the proxy's point that lies farthest toward a direction,
// and the mean normal of 15 mm about it.
struct ScopeAim {
  Eigen::Vector3d point_mm, normal;
};

ScopeAim scope_aim(const TriangleMesh& proxy, const Vector3d& toward) {
  constexpr double kAround_mm = 15;
  const Vector3d& seen = *std::max_element(
      proxy.vertices.begin(), proxy.vertices.end(),
      [&](const Vector3d& a, const Vector3d& b) { return a.dot(toward) < b.dot(toward); });
  Vector3d normal = Vector3d::Zero();
  for (const Face& face : proxy.faces) {
    const Vector3d &a = proxy.vertices[face[0]], &b = proxy.vertices[face[1]],
                   &c = proxy.vertices[face[2]];
    if (((a + b + c) / 3 - seen).norm() < kAround_mm) normal += (b - a).cross(c - a);
  }
  return {seen, (normal.norm() > 0 ? normal : toward).normalized()};
}

View view_from(const Vector3d& eye_mm, const Vector3d& right, const Vector3d& ahead, int width_px) {
  const int height_px = width_px * 9 / 16;
  const double focal_px = kScopeFocal_widths * width_px;
  View view;
  view.camera.intrinsics = {width_px, height_px,      focal_px,
                            focal_px, 0.5 * width_px, 0.5 * height_px};
  Eigen::Matrix3d& rotation = view.camera.camera_from_world.rotation;
  rotation.row(0) = right;
  rotation.row(1) = ahead.cross(right);
  rotation.row(2) = ahead;
  view.camera.camera_from_world.translation = -rotation * eye_mm;
  return view;
}

// From range_mm over that point, leaning by some 25°.
View scope_view(const ScopeAim& aim, double range_mm, int width_px) {
  constexpr double kLean = 0.45;
  const Vector3d across = aim.normal.unitOrthogonal();
  const Vector3d away = (aim.normal + kLean * across).normalized();
  return view_from(aim.point_mm + range_mm * away, aim.normal.cross(across), -away, width_px);
}

// As the shared video shows its liver: by the gallbladder's width of about 25 mm.
constexpr double kFrame_mm_per_pixel = 0.15;
constexpr int kFrame_px = 1280;  // across

// Frames some seconds apart, of every second piece of the clip, where at least a tenth of the
// picture is liver.
std::vector<TissuePicture> real_pictures(const std::filesystem::path& video, std::size_t apart) {
  constexpr double kLeastShare = 0.1;
  constexpr std::size_t kPiece = 20;  // the look was chosen by frames 60 and 180
  std::vector<TissuePicture> pictures;
  VideoReader reader(video);
  StoredPicture frame;
  for (std::size_t number = 0; reader.next(frame); ++number) {
    if (number % apart != 0 || number / kPiece % 2 != 0) continue;
    std::vector<std::uint8_t> mask = liver_mask(frame.color);
    const auto tissue = std::count(mask.begin(), mask.end(), std::uint8_t{1});
    if (static_cast<double>(tissue) < kLeastShare * static_cast<double>(mask.size())) continue;
    pictures.push_back({frame.color, std::move(mask), kFrame_mm_per_pixel});
  }
  return pictures;
}

// From as far as the video's scope, by its lens: the eye is straight over the aim, whose skin so
// mirrors the lamp, and looks past it by as much as the liver's highlights lie off the axis in the
// frames that the look was chosen by.
View frame_view(const ScopeAim& aim) {
  constexpr double kPast_rad = 0.31,
                   kRange_mm = kFrame_mm_per_pixel * kScopeFocal_widths * kFrame_px;
  const Vector3d across = aim.normal.unitOrthogonal();
  return view_from(aim.point_mm + kRange_mm * aim.normal,
                   std::cos(kPast_rad) * across + std::sin(kPast_rad) * aim.normal,
                   std::sin(kPast_rad) * across - std::cos(kPast_rad) * aim.normal, kFrame_px);
}

// Four places of a bundle, each as the video would show it.
std::vector<TissuePicture> rendered_pictures(Player& player) {
  std::vector<TissuePicture> pictures;
  for (const Eigen::Vector3d& toward :
       {Eigen::Vector3d(-0.2, -1, 0.1), {0.5, -0.8, -0.3}, {-0.6, -0.7, 0.4}, {0.1, -0.9, 0.5}}) {
    DrawOptions options;
    options.light = player.light_for();
    Frame frame;
    player.draw(frame_view(scope_aim(player.bundle().proxy, toward)), options, frame);
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
void compare(const std::string& what, const std::vector<TissuePicture>& ours,
             const std::vector<TissuePicture>& real, double target) {
  ASSERT_GE(real.size(), 2u) << what << ": too few real pictures to differ";
  ASSERT_FALSE(ours.empty()) << what;
  const std::vector<TissueAppearance> of_real = appearances(real);
  const std::vector<TissueAppearancePart> times =
      in_real_differences(mean_parts(appearances(ours), of_real), mean_parts(of_real, of_real));
  for (const TissueAppearancePart& part : times)
    report(what + ": " + part.name, "× two real frames", part.distance);
  expect({what, "× two real frames", mean_distance(times), target});
}

// As liver.yaml bakes it.
constexpr const char* kLiver =
    "schema: organbake/recipe/1\nname: liver\nisosurface: {smooth_mm: 1.5, largest: 1}\n"
    "decimate: {faces: 300}\nmechanics: {young_modulus_kpa: 10}\nplace: {count: 12}\n";

// A frame, and the mean light of sixteen pixels for each of its own.
std::pair<Rgb8Image, TruthFrame> drawn_and_true(Player& player, const ScopeAim& aim,
                                                double range_mm) {
  constexpr int kWidth_px = 320, kSide = TruthFrame::kRaysPerSide;
  DrawOptions options;
  options.light = player.light_for();
  Frame frame, fine;
  player.draw(scope_view(aim, range_mm, kWidth_px), options, frame);
  player.draw(scope_view(aim, range_mm, kSide * kWidth_px), options, fine);
  const int width = frame.color.width, height = frame.color.height;
  TruthFrame truth{Rgb8Image(width, height), {}, {}, {}};
  truth.covered.assign(std::size_t(width) * height, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int k = 0; k < TruthFrame::kRaysPerPixel; ++k) {
        const int u = kSide * x + k % kSide, v = kSide * y + k / kSide;
        for (int c = 0; c < 3; ++c) sum[c] += linear_from_srgb8()[fine.color.at(u, v)[c]];
        truth.covered[std::size_t(y) * width + x] +=
            fine.cover[std::size_t(v) * fine.color.width + u] != Cover::background;
      }
      for (int c = 0; c < 3; ++c)
        truth.color.at(x, y)[c] = srgb8_from_linear(sum[c] / TruthFrame::kRaysPerPixel);
    }
  return {std::move(frame.color), std::move(truth)};
}

// Light that is too fine for a pixel crawls: from frame to frame it steps by more than the truth.
// move: brings the player to a share of its way, and tells from how far it is seen.
void expect_no_crawl(Player& player, const std::string& what,
                     const std::function<double(double share)>& move) {
  const ScopeAim aim = scope_aim(player.bundle().proxy, {-0.2, -1, 0.1});
  const int frames = cases(40, 200);
  double largest = 0;
  auto before = drawn_and_true(player, aim, move(0));
  for (int k = 1; k < frames; ++k) {
    auto now = drawn_and_true(player, aim, move(double(k) / (frames - 1)));
    largest =
        std::max(largest, switch_steps(before.first, now.first, before.second, now.second).excess);
    before = std::move(now);
  }
  expect({what + ": largest step of 8 × 8 pixels beyond the supersampled truth's",
          "% of full scale", 100 * largest / 255, 1.2});
}

void measure_crawl(Player& player) {
  expect_no_crawl(player, "CT liver, an approach from 100 to 25 mm",
                  [](double share) { return 100 - 75 * share; });
  const ScopeAim aim = scope_aim(player.bundle().proxy, {-0.2, -1, 0.1});
  expect_no_crawl(player, "CT liver, a poke of 10 mm from 50 mm", [&](double share) {
    constexpr double kRadius_mm = 4, kDeepest_mm = 10, kRange_mm = 50;
    player.step({{.position_mm = aim.point_mm + (kRadius_mm - kDeepest_mm * share) * aim.normal,
                  .radius_mm = kRadius_mm,
                  .active = true}});
    return kRange_mm;
  });
}

std::filesystem::path baked_organ(const TemporaryFolder& folder, const std::string& label,
                                  const std::string& capture) {
  const std::filesystem::path bundle = folder.path() / "bundle";
  Baker(folder.path(), {}, kLiver + capture)
      .bake(bundle, {"--set", "ct=" + shared_data("ct/abdomen/example_ct.nii.gz").string(), "--set",
                     "mask=" + shared_data("ct/abdomen/example_seg.nii.gz").string(), "--set",
                     "label=" + label});
  return bundle;
}

// Where frames show other tissues than liver, looked up by eye: of pieces of the clip that their
// look was not chosen by.
struct BrightFrame {
  std::size_t number;
  BrightTissue tissue;
};
using BrightFrames = std::array<BrightFrame, 4>;
constexpr double kPale = 40, kYellowish = 5, kFatty = 30, kYellow = 18;
constexpr BrightFrames kGallbladders = {{{60, {330, 150, 575, 560, kPale, kYellowish}},
                                         {100, {365, 111, 618, 544, kPale, kYellowish}},
                                         {140, {426, 46, 741, 528, kPale, kYellowish}},
                                         {180, {450, 110, 672, 600, kPale, kYellowish}}}};
constexpr BrightFrames kFats = {{{60, {590, 560, 960, 660, kFatty, kYellow}},
                                 {100, {624, 494, 1038, 642, kFatty, kYellow}},
                                 {140, {747, 435, 1112, 577, kFatty, kYellow}},
                                 {180, {690, 620, 860, 700, kFatty, kYellow}}}};

std::vector<TissuePicture> bright_pictures(const BrightFrames& frames) {
  std::vector<TissuePicture> pictures;
  VideoReader reader(shared_data("video/laparoscopy_720p_25fps.mp4"));
  StoredPicture frame;
  for (std::size_t number = 0; reader.next(frame); ++number)
    for (const BrightFrame& bright : frames)
      if (bright.number == number)
        pictures.push_back(
            {frame.color, bright_mask(frame.color, bright.tissue), kFrame_mm_per_pixel});
  return pictures;
}

std::ptrdiff_t tissue_px(const TissuePicture& picture) {
  return std::count(picture.mask.begin(), picture.mask.end(), std::uint8_t{1});
}

// Of each picture the pieces with the most tissue, of as many millimetres as a view from that
// range.
std::vector<TissuePicture> pieces_of(const std::vector<TissuePicture>& pictures, double range_mm) {
  constexpr std::size_t kOfEach = 3;
  constexpr std::ptrdiff_t kLeastTissue_px = 6000;  // some 150 mm²
  const double width_px = range_mm / kScopeFocal_widths / kFrame_mm_per_pixel;
  const int width = int(width_px), height = int(width_px * 9 / 16);
  std::vector<TissuePicture> pieces;
  for (const TissuePicture& picture : pictures) {
    std::vector<TissuePicture> of_picture;
    for (int y = 0; y + height <= picture.image.height; y += height / 2)
      for (int x = 0; x + width <= picture.image.width; x += width / 2)
        of_picture.push_back(piece_of(picture, x, y, width, height));
    std::erase_if(of_picture,
                  [](const TissuePicture& piece) { return tissue_px(piece) < kLeastTissue_px; });
    std::stable_sort(of_picture.begin(), of_picture.end(),
                     [](const auto& a, const auto& b) { return tissue_px(a) > tissue_px(b); });
    of_picture.resize(std::min(of_picture.size(), kOfEach));
    std::move(of_picture.begin(), of_picture.end(), std::back_inserter(pieces));
  }
  return pieces;
}

// Ours are cut as the frames are. As much as a view shows from 100 mm fits into a frame once only:
// seven frames of one place differ by less than two places do.
void compare_pieces(const std::string& what, const std::vector<TissuePicture>& rendered,
                    const std::vector<TissuePicture>& frames) {
  for (const double range_mm : {60.0, 30.0})
    compare(what + ", pieces as from " + to_text(range_mm) + " mm", pieces_of(rendered, range_mm),
            pieces_of(frames, range_mm), 1.4);
}

void measure_look(const std::string& look, const std::string& capture,
                  const std::vector<TissuePicture>& real, double target) {
  const TemporaryFolder folder;
  Player player(baked_organ(folder, "liver", capture));
  const std::vector<TissuePicture> rendered = rendered_pictures(player);
  const std::string what = "CT liver, " + look;
  compare(what + ", against the video's liver", rendered, real, target);
  show(side_by_side(rendered.front().image, real.front().image),
       what + ", and a frame of the video");
  if (player.bundle().lighting->finish.relief_slope == 0) return;
  compare_pieces(what, rendered, real);
  measure_crawl(player);
}

// A material on an organ of the shared CT, against pieces of frames.
void measure_pieces(const std::string& material, const std::vector<TissuePicture>& frames) {
  const TemporaryFolder folder;
  Player player(baked_organ(folder, "stomach", "capture: {material: " + material + "}\n"));
  const std::vector<TissuePicture> rendered = rendered_pictures(player);
  compare_pieces(material, rendered, frames);
  show(side_by_side(rendered.front().image, frames.front().image), material);
}

TEST(Appearance, OfOtherMaterialsIsNearThatOfPiecesOfTheVideo) {
  REQUIRE_SHARED_DATA("video/laparoscopy_720p_25fps.mp4");
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct.nii.gz");
  measure_pieces("gallbladder", bright_pictures(kGallbladders));
  measure_pieces("fat", bright_pictures(kFats));
}

TEST(Appearance, OfACtLiverIsNearThatOfTheVideo) {
  REQUIRE_SHARED_DATA("video/laparoscopy_720p_25fps.mp4");
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct.nii.gz");
  const auto real = real_pictures(shared_data("video/laparoscopy_720p_25fps.mp4"),
                                  static_cast<std::size_t>(cases(20, 10)));
  ASSERT_GE(real.size(), 2u) << "the video shows liver in less than two frames";
  measure_look("by its material", "capture: {material: liver}\n", real, 2);
  measure_look("plain", "capture: {albedo: [0.42, 0.13, 0.1]}\n", real, 5);
}

// A square of mottled tissue whose outermost pixels glow by so many levels, as in a frame beside
// brighter tissue.
TissuePicture square_of_tissue(int glow) {
  constexpr int kSize_px = 240, kSide_px = 180, kFirst = (kSize_px - kSide_px) / 2;
  TissuePicture picture{Rgb8Image(kSize_px, kSize_px), {}, TissueAppearance::kGrain_mm};
  RandomStream random(3);
  for (int y = 0; y < kSize_px; ++y)
    for (int x = 0; x < kSize_px; ++x) {
      const int inside =
          std::min({x - kFirst, y - kFirst, kFirst + kSide_px - 1 - x, kFirst + kSide_px - 1 - y});
      picture.mask.push_back(inside >= 0);
      const int level = 80 + static_cast<int>(random.below(30)) + (inside == 0 ? glow : 0);
      for (int c = 0; c < 3; ++c) picture.image.at(x, y)[c] = std::uint8_t(level);
    }
  return picture;
}

TEST(TissueAppearance, ABandIsThatOfTheTissueNotOfItsRim) {
  const TissueAppearance plain = appearance_of(square_of_tissue(0)),
                         beside = appearance_of(square_of_tissue(50));
  for (int k = 0; k < TissueAppearance::kOctaves; ++k) {
    EXPECT_NEAR(beside.energy[k], plain.energy[k], 0.35);
    EXPECT_NEAR(beside.kurtosis[k], plain.kurtosis[k], 0.2 * plain.kurtosis[k]);
  }
}

}  // namespace
}  // namespace organbake
