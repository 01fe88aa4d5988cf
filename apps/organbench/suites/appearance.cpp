// SPDX-License-Identifier: GPL-3.0-or-later
// How near the look of an organ's material is to that of real frames, where surgeons work: from
// 100, 60 and 30 mm, every picture brought to the frames' millimetres a pixel and held against
// pieces of them that show as many millimetres. 1 is what two real pieces differ by.
#include <algorithm>
#include <array>
#include <cmath>

#include "bench.h"
#include "measuring/material_bundle.h"
#include "measuring/scope_views.h"
#include "measuring/tissue_appearance.h"
#include "organbake/player/player.h"
#include "organbake/shading/video_reader.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// As the shared video shows its liver: by the gallbladder's width of about 25 mm.
constexpr double kVideo_mm_per_pixel = 0.15;
constexpr std::size_t kFramesApart = 40;
constexpr std::ptrdiff_t kLeastTissue_px = 6000;  // of a piece: some 150 mm²
constexpr int kScopeWidth = 1280, kScopeHeight = 720;
constexpr double kFocal_px = kScopeFocal_widths * kScopeWidth;

// Where the frames, kFramesApart apart, show other tissues than liver: looked up by eye.
constexpr double kPale = 40, kYellowish = 5, kFatty = 30, kYellow = 18;
constexpr std::array<BrightTissue, 4> kGallbladders = {{{590, 111, 857, 556, kPale, kYellowish},
                                                        {367, 111, 640, 640, kPale, kYellowish},
                                                        {334, 60, 612, 530, kPale, kYellowish},
                                                        {320, 90, 580, 590, kPale, kYellowish}}};
constexpr std::array<BrightTissue, 4> kFats = {{{849, 515, 1155, 654, kFatty, kYellow},
                                                {640, 540, 1085, 655, kFatty, kYellow},
                                                {612, 455, 1113, 560, kFatty, kYellow},
                                                {584, 506, 1000, 645, kFatty, kYellow}}};

// A material, the organ of the shared CT whose shape it gets, and where the frames show it.
struct MaterialCase {
  const char *material, *organ;
  const std::array<BrightTissue, 4>* places;  // nullptr: liver
  double target;
};
constexpr std::array<MaterialCase, 3> kMaterials = {
    {{"liver", "liver", nullptr, 1.5},
     {"gallbladder", "stomach", &kGallbladders, 1.8},
     {"fat", "stomach", &kFats, 1.8}}};

std::vector<TissuePicture> real_frames(const std::filesystem::path& video,
                                       const MaterialCase& material) {
  std::vector<TissuePicture> pictures;
  VideoReader reader(video);
  StoredPicture frame;
  for (std::size_t number = 0; reader.next(frame) && pictures.size() < 4; ++number) {
    if (number % kFramesApart != 0) continue;
    const std::size_t place = number / kFramesApart;
    pictures.push_back({frame.color,
                        material.places ? bright_mask(frame.color, (*material.places)[place])
                                        : liver_mask(frame.color),
                        kVideo_mm_per_pixel});
  }
  return pictures;
}

TissuePicture piece_of(const TissuePicture& picture, int x0, int y0, int width, int height) {
  TissuePicture piece{Rgb8Image(width, height), {}, picture.mm_per_pixel};
  for (int y = 0; y < height; ++y) {
    std::copy_n(picture.image.at(x0, y0 + y), 3 * width, piece.image.at(0, y));
    const auto row = picture.mask.begin() + std::ptrdiff_t(y0 + y) * picture.image.width + x0;
    piece.mask.insert(piece.mask.end(), row, row + width);
  }
  return piece;
}

std::ptrdiff_t tissue_px(const TissuePicture& picture) {
  return std::count(picture.mask.begin(), picture.mask.end(), std::uint8_t{1});
}

// Pieces of the frames of as many millimetres as a view from that range shows, with the most tissue
// of each frame.
std::vector<TissuePicture> real_pieces(const std::vector<TissuePicture>& frames, double range_mm) {
  constexpr std::size_t kOfEachFrame = 3;
  const double shrink = range_mm / kFocal_px / kVideo_mm_per_pixel;
  std::vector<TissuePicture> pieces;
  for (const TissuePicture& frame : frames) {
    const int width = std::min(frame.image.width, int(kScopeWidth * shrink));
    const int height = std::min(frame.image.height, int(kScopeHeight * shrink));
    std::vector<TissuePicture> of_frame;
    for (int y = 0; y + height <= frame.image.height; y += std::max(1, height / 2))
      for (int x = 0; x + width <= frame.image.width; x += std::max(1, width / 2))
        of_frame.push_back(piece_of(frame, x, y, width, height));
    std::erase_if(of_frame, [](const auto& piece) { return tissue_px(piece) < kLeastTissue_px; });
    std::stable_sort(of_frame.begin(), of_frame.end(),
                     [](const auto& a, const auto& b) { return tissue_px(a) > tissue_px(b); });
    of_frame.resize(std::min(of_frame.size(), kOfEachFrame));
    std::move(of_frame.begin(), of_frame.end(), std::back_inserter(pieces));
  }
  return pieces;
}

std::vector<TissuePicture> drawn_from(Player& player, double range_mm) {
  std::vector<TissuePicture> pictures;
  for (const Vector3d& toward : {Vector3d(-0.2, -1, 0.1), Vector3d(0.5, -0.8, -0.3),
                                 Vector3d(-0.6, -0.7, 0.4), Vector3d(0.1, -0.9, 0.5)}) {
    DrawOptions options;
    options.light = player.default_light();
    Frame frame;
    const ScopeAim aim = scope_aim(player.bundle().proxy, toward);
    player.draw(scope_view(aim, range_mm, kScopeWidth), options, frame);
    TissuePicture picture{frame.color, {}, range_mm / kFocal_px};
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

double mean_sharpness(const std::vector<TissuePicture>& pictures) {
  double sum = 0;
  for (const TissuePicture& picture : pictures)
    sum += std::log(sharpness_of(in_pixels_of(picture, kVideo_mm_per_pixel))) / pictures.size();
  return std::exp(sum);
}

// What was measured of highlights, ours beside the least and most of real pieces.
void show_highlights(Bench& bench, const std::string& what,
                     const std::vector<TissueAppearance>& ours,
                     const std::vector<TissueAppearance>& real) {
  using Number = double TissueAppearance::*;
  const std::array<std::pair<const char*, Number>, 4> numbers = {
      {{"share", &TissueAppearance::highlight_share},
       {"log2 of count in 10 cm²", &TissueAppearance::highlight_count},
       {"log2 of median mm²", &TissueAppearance::highlight_size},
       {"elongation", &TissueAppearance::highlight_elongation}}};
  for (const auto& [name, number] : numbers) {
    double mean = 0, least = 1e9, most = -1e9;
    for (const TissueAppearance& a : ours) mean += a.*number / double(ours.size());
    for (const TissueAppearance& a : real)
      least = std::min(least, a.*number), most = std::max(most, a.*number);
    bench.at_least(what + ", highlights, " + name + ", least of real", "", mean, least);
    bench.at_most(what + ", highlights, " + name + ", most of real", "", mean, most);
  }
}

// Two views of ours above two pieces of the frames, as many millimetres wide.
void show_beside(Bench& bench, const std::string& what, const std::vector<TissuePicture>& ours,
                 const std::vector<TissuePicture>& real) {
  constexpr int kWidth_px = 600, kHeight_px = kWidth_px * kScopeHeight / kScopeWidth;
  Rgb8Image sheet(2 * kWidth_px, 2 * kHeight_px);
  for (int k = 0; k < 4; ++k) {
    const std::vector<TissuePicture>& from = k < 2 ? ours : real;
    const TissuePicture& picture = from[k % 2 == 0 ? 0 : from.size() / 2];
    const Rgb8Image piece =
        in_size_of(in_pixels_of(picture, kVideo_mm_per_pixel).image, kWidth_px, kHeight_px);
    for (int y = 0; y < kHeight_px; ++y)
      std::copy_n(piece.at(0, y), 3 * kWidth_px,
                  sheet.at(k % 2 * kWidth_px, k / 2 * kHeight_px + y));
  }
  bench.show(sheet, what + ", above pieces of real frames");
}

void measure_material(Bench& bench, const MaterialCase& material, Player& player,
                      const std::vector<TissuePicture>& frames) {
  for (const double range_mm : {100.0, 60.0, 30.0}) {
    const std::string what =
        std::string(material.material) + " from " + std::to_string(int(range_mm)) + " mm";
    const std::vector<TissuePicture> real = real_pieces(frames, range_mm);
    if (real.size() < 2) {
      bench.skip(what, "the frames show too little of it to tell how two pieces differ");
      continue;
    }
    const std::vector<TissuePicture> ours = drawn_from(player, range_mm);
    show_beside(bench, what, ours, real);
    const std::vector<TissueAppearance> of_real = appearances(real), of_ours = appearances(ours);
    const auto times =
        in_real_differences(mean_parts(of_ours, of_real), mean_parts(of_real, of_real));
    for (const TissueAppearancePart& part : times)
      bench.at_most(what + ": " + part.name, "× two real pieces", part.distance, 5);
    bench.at_most(what, "× two real pieces", mean_distance(times), material.target);
    show_highlights(bench, what, of_ours, of_real);
    const double sharpness = mean_sharpness(ours) / mean_sharpness(real);
    bench.at_least(what + ": sharpness, least", "× real", sharpness, 0.7);
    bench.at_most(what + ": sharpness, most", "× real", sharpness, 1.3);
  }
}

void run_appearance(Bench& bench) {
  const std::filesystem::path video = bench.data("video/laparoscopy_720p_25fps.mp4");
  if (video.empty()) return;
  for (const MaterialCase& material : kMaterials) {
    if (!bench.wants(material.material)) continue;
    bench.now(material.material);
    const std::filesystem::path bundle = material_bundle(bench, material.organ, material.material);
    if (bundle.empty()) return;
    Player player(bundle);
    measure_material(bench, material, player, real_frames(video, material));
  }
}

const RegisteredPart kAppearance("appearance", run_appearance,
                                 "the look of materials from 100, 60 and 30 mm beside real frames");

}  // namespace
}  // namespace organbake
