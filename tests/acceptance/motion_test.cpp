// SPDX-License-Identifier: GPL-3.0-or-later

#include "measuring/programs.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/png.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/masks.h"
#include "promises.h"
#include "support/testing.h"

namespace organbake {
namespace {

// What a recorder lays over a clip of tissue changes nothing of what the tissue tells.

constexpr int kClipWidth = 480, kClipHeight = 360, kFrames = 40;

// Pixels that the recorder has for itself.
struct LaidOver {
  std::string name;
  int left, top, width, height;
  double area() const { return double(width) * height; }
  bool has(int x, int y) const {
    return x >= left && x < left + width && y >= top && y < top + height;
  }
};

void paint(Rgb8Image& frame, const LaidOver& box, const std::array<std::uint8_t, 3>& color) {
  for (int y = box.top; y < box.top + box.height; ++y)
    for (int x = box.left; x < box.left + box.width; ++x)
      std::copy(color.begin(), color.end(), frame.at(x, y));
}

// The middle of another picture, in grey, as an ultrasound machine's.
void lay_picture(Rgb8Image& frame, const LaidOver& box, const Rgb8Image& other) {
  for (int y = 0; y < box.height; ++y)
    for (int x = 0; x < box.width; ++x)
      std::fill_n(
          frame.at(box.left + x, box.top + y), 3,
          other.at((other.width - box.width) / 2 + x, (other.height - box.height) / 2 + y)[1]);
}

// Letters, of which the last ones change once a second, as a clock's.
void lay_text(Rgb8Image& frame, const LaidOver& box, int second) {
  paint(frame, box, {200, 200, 180});
  const int size = box.height / 4;
  for (int i = 0; (2 * i + 2) * size < box.width; ++i) {
    const int bits = 0x5A3C7 * (i + 1) + ((2 * i + 6) * size >= box.width ? 0x1111 * second : 0);
    for (int bit = 0; bit < 12; ++bit)
      if (bits >> bit & 1)
        paint(frame,
              {"", box.left + (2 * i + 1) * size + bit % 3 * size / 3,
               box.top + 3 * size / 2 + bit / 3 * size / 4, size / 3, size / 4},
              {20, 20, 40});
  }
}

const std::vector<LaidOver> kLaidOver = {{"still inset", 160, 200, 160, 90},
                                         {"live inset", 90, 60, 120, 96},
                                         {"bar", 0, 300, 480, 60},
                                         {"corner logo", 330, 44, 48, 36}};

// A clip of the phantom, and what was in its place in truth.
struct TrueClip {
  std::vector<LaparoscopyFrame> frames;
  explicit TrueClip(std::uint64_t seed) {
    constexpr std::array kPaths = {ScopePath::slide, ScopePath::tour, ScopePath::orbit};
    MovingClipOptions options;
    options.view = {.seed = seed,
                    .width = kClipWidth,
                    .height = kClipHeight,
                    .frames = kFrames,
                    .instrument = false};
    options.path = kPaths[seed % kPaths.size()];
    const MovingClip clip(options);
    for (int i = 0; i < kFrames; ++i) frames.push_back(clip.frame(i));
  }
};

void lay(const LaidOver& box, const TrueClip& other, int i, Rgb8Image& frame) {
  if (box.name == "still inset") lay_picture(frame, box, other.frames[0].image);
  if (box.name == "live inset")
    lay_picture(frame, box, other.frames[static_cast<std::size_t>(i)].image);
  if (box.name == "bar" || box.name == "corner logo") lay_text(frame, box, i / 10);
}

// What `organbake motion` makes of frames, their lens unknown.
struct Told {
  double focal_px = 0, focal_sd_px = 0;
  std::map<int, Plane> depth;  // by its frame
};

Told told_of(const std::vector<Rgb8Image>& frames) {
  const TemporaryFolder folder;
  make_folder(folder.path() / "frames");
  for (std::size_t i = 0; i < frames.size(); ++i)
    write_png(frame_file(folder.path() / "frames", static_cast<int>(i), ".png"), frames[i], 1);
  const MotionRun run = run_motion(folder.path() / "frames", {}, folder.path() / "motion", {});
  EXPECT_EQ(run.refusal, "");
  if (!run.refusal.empty()) return {};
  const auto figures =
      nlohmann::json::parse(read_text_file(run.folder / "report.json")).at("figures");
  Told told{figures.at("focal_px"), figures.at("focal_sd_px"), {}};
  for (const int i : frames_with_depth(run.folder / "depth"))
    told.depth[i] = read_depth(frame_file(run.folder / "depth", i, ".exr"));
  return told;
}

// Of the depth beside a box the 95th percentile of its errors after one scale, in percent; and the
// share of the box that has depth.
struct DepthFigures {
  double p95_percent = 0, in_box = 0;
};

DepthFigures figures_of(const Told& told, const TrueClip& truth, const LaidOver& box) {
  std::vector<double> ratios;
  double inside = 0, pixels = 0;
  for (const auto& [i, depth] : told.depth) {
    const Plane& known = truth.frames[static_cast<std::size_t>(i)].depth_mm;
    const int step = known.width / depth.width;
    for (int y = 0; y < depth.height; ++y)
      for (int x = 0; x < depth.width; ++x) {
        const bool in_box = box.has(step * x, step * y), has = std::isfinite(depth.at(x, y));
        const double right = known.at(step * x + step / 2, step * y + step / 2);
        pixels += in_box;
        inside += in_box && has;
        if (!in_box && has && std::isfinite(right)) ratios.push_back(depth.at(x, y) / right);
      }
  }
  if (ratios.empty()) return {};
  const double scale = median(ratios);
  for (double& ratio : ratios) ratio = 100 * std::abs(ratio / scale - 1);
  return {quantile(ratios, 0.95), inside / std::max(1.0, pixels)};
}

// Of the frames alone: what of the box is found, and what of the tissue is lost to it, in percent.
std::pair<double, double> found_and_lost(const std::vector<Rgb8Image>& frames,
                                         const TrueClip& truth, const LaidOver& box) {
  InsetFinder finder;
  for (const Rgb8Image& frame : frames) finder.add(frame);
  const Mask mask = finder.find();
  double found = 0, lost = 0, tissue = 0;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      const bool is_tissue = !box.has(x, y) && std::isfinite(truth.frames[0].depth_mm.at(x, y));
      found += box.has(x, y) && mask.at(x, y);
      tissue += is_tissue;
      lost += is_tissue && mask.at(x, y);
    }
  return {100 * found / box.area(), 100 * lost / std::max(1.0, tissue)};
}

void expect_insets_left_out(std::uint64_t seed) {
  const double focal_px = 0.5 * kClipWidth / std::tan(0.5 * LaparoscopyOptions{}.field_of_view_rad);
  const TrueClip truth(seed), other(seed + 1000);
  std::vector<Rgb8Image> plain_frames;
  for (const LaparoscopyFrame& frame : truth.frames) plain_frames.push_back(frame.image);
  const Told plain = told_of(plain_frames);
  const auto off = [&](const Told& told) { return std::abs(told.focal_px - focal_px); };
  const std::string clip = "clip " + std::to_string(seed) + ", ";
  report(clip + "plain: focal length off the truth", "%", 100 * off(plain) / focal_px);
  EXPECT_EQ(found_and_lost(plain_frames, truth, {}).second, 0) << "an inset where there is none";
  for (const LaidOver& box : kLaidOver) {
    std::vector<Rgb8Image> frames = plain_frames;
    for (int i = 0; i < kFrames; ++i) lay(box, other, i, frames[static_cast<std::size_t>(i)]);
    const auto [found, lost] = found_and_lost(frames, truth, box);
    const Told told = told_of(frames);
    const DepthFigures depth = figures_of(told, truth, box), before = figures_of(plain, truth, box);
    const std::string what = clip + box.name + ": ";
    expect({what + "left out", "%", found, 98, Figure::Goal::at_least});
    expect({what + "tissue lost", "%", lost, 1});
    expect({what + "with depth all the same", "%", 100 * depth.in_box, 2});
    expect({what + "focal length off the truth", "%", 100 * off(told) / focal_px, 3});
    // The spread is of one clip's parts, and errs by half of itself.
    const double sd_px = std::max(told.focal_sd_px, plain.focal_sd_px);
    expect({what + "focal length off the plain clip's", "sd",
            std::abs(told.focal_px - plain.focal_px) / sd_px, 2});
    report(what + "focal length off the truth", "sd", off(told) / told.focal_sd_px);
    report(what + "depth beside it, p95 of the plain clip", "%", before.p95_percent);
    expect({what + "depth beside it, p95 by the plain clip's", "",
            depth.p95_percent / before.p95_percent, 1.2});
  }
}

TEST(Insets, ChangeNothingOfWhatTheTissueTells) {
  const Seeds seeds = asked_seeds(1, 10);
  for (std::uint64_t i = 0; i < seeds.count; ++i) expect_insets_left_out(seeds.first + i);
}

}  // namespace
}  // namespace organbake
