// SPDX-License-Identifier: GPL-3.0-or-later
// What a re-encoding, a gain, a shift by a pixel or noise does to depth: nothing, ideally.
#include <turbojpeg.h>

#include "organbake/core/random.h"
#include "organbake/image/channel_image.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/frame_source.h"
#include "promises.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {
namespace {

enum class ChromaSampling { full, halved };  // 4:4:4, 4:2:0

// The picture as a JPEG of this quality (1…100) gives it back.
Rgb8Image through_jpeg(const Rgb8Image& image, int quality, ChromaSampling chroma) {
  const int sampling = chroma == ChromaSampling::full ? TJSAMP_444 : TJSAMP_420;
  Rgb8Image back(image.width, image.height);
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  tjhandle handle = tjInitCompress();
  tjCompress2(handle, image.pixels.data(), image.width, 0, image.height, TJPF_RGB, &bytes, &count,
              sampling, quality, TJFLAG_ACCURATEDCT);
  tjDestroy(handle);
  handle = tjInitDecompress();
  tjDecompress2(handle, bytes, count, back.pixels.data(), image.width, 0, image.height, TJPF_RGB,
                TJFLAG_ACCURATEDCT);
  tjDestroy(handle);
  tjFree(bytes);
  return back;
}

Rgb8Image of_gain(Rgb8Image image, float gain) {
  for (std::uint8_t& level : image.pixels)
    level = srgb8_from_linear(std::min(1.F, gain * linear_from_srgb8()[level]));
  return image;
}

Rgb8Image of_noise(Rgb8Image image) {
  constexpr int kLevels = 2;
  RandomStream random(5);
  for (std::uint8_t& level : image.pixels)
    level = static_cast<std::uint8_t>(
        std::clamp<int>(int(level) + int(random.below(2 * kLevels + 1)) - kLevels, 0, 255));
  return image;
}

Rgb8Image shifted(const Rgb8Image& image) {
  Rgb8Image moved = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::copy_n(image.at(std::min(x + 1, image.width - 1), y), 3, moved.at(x, y));
  return moved;
}

struct HarmlessChange {
  std::string name;
  std::function<Rgb8Image(const Rgb8Image&)> apply;
  double shift_px = 0;
};

std::vector<HarmlessChange> harmless_changes() {
  return {
      {"JPEG 100, 4:4:4",
       [](const Rgb8Image& i) { return through_jpeg(i, 100, ChromaSampling::full); }},
      {"JPEG 95, 4:2:0",
       [](const Rgb8Image& i) { return through_jpeg(i, 95, ChromaSampling::halved); }},
      {"JPEG 90, 4:2:0",
       [](const Rgb8Image& i) { return through_jpeg(i, 90, ChromaSampling::halved); }},
      {"gain +2 %", [](const Rgb8Image& i) { return of_gain(i, 1.02F); }},
      {"gain -2 %", [](const Rgb8Image& i) { return of_gain(i, 0.98F); }},
      {"a pixel aside", shifted, 1},
      {"+-2 levels", of_noise},
  };
}

struct DepthChange {
  double mean = 0, p99 = 0;  // percent
};

// One scale fitted; `shift_px` of the depth's own pixels to the right in `before`.
DepthChange change_between(const Plane& before, const Plane& after, double shift_px) {
  std::vector<double> logs;
  for (int y = 0; y < before.height; ++y)
    for (int x = 0; x + 1 < before.width; ++x) {
      const double moved =
          (1 - shift_px) * before.at(x, y) + (shift_px > 0 ? shift_px * before.at(x + 1, y) : 0);
      if (std::isfinite(moved) && std::isfinite(after.at(x, y)))
        logs.push_back(std::log(after.at(x, y) / moved));
    }
  if (logs.empty()) return {100, 100};
  std::nth_element(logs.begin(), logs.begin() + std::ptrdiff_t(logs.size() / 2), logs.end());
  const double middle = logs[logs.size() / 2];
  double sum = 0;
  for (double& value : logs) sum += value = 100 * std::abs(std::expm1(value - middle));
  const auto high = logs.begin() + std::ptrdiff_t(logs.size() * 99 / 100);
  std::nth_element(logs.begin(), high, logs.end());
  return {sum / double(logs.size()), *high};
}

Plane depth_of(const Rgb8Image& image) {
  constexpr double kFieldOfView = 1.22;
  const Intrinsics camera = assumed_camera(image.width, image.height, kFieldOfView);
  return shade_frame(prepare_frame(image, camera, {.halvings = 1}), {}).depth;
}

void add_figures(const std::string& what, const std::vector<Rgb8Image>& frames) {
  constexpr double kMostMean = 1, kMostP99 = 3;
  DepthChange worst;
  for (const HarmlessChange& change : harmless_changes()) {
    DepthChange of_change;
    for (const Rgb8Image& frame : frames) {
      const DepthChange found =
          change_between(depth_of(frame), depth_of(change.apply(frame)), change.shift_px / 2);
      of_change.mean = std::max(of_change.mean, found.mean);
      of_change.p99 = std::max(of_change.p99, found.p99);
    }
    report(what + ", " + change.name + ": depth changes, mean", "%", of_change.mean);
    worst.mean = std::max(worst.mean, of_change.mean);
    worst.p99 = std::max(worst.p99, of_change.p99);
  }
  expect({what + ": mean, worst frame and change", "%", worst.mean, kMostMean});
  expect({what + ": 99th percentile, worst frame and change", "%", worst.p99, kMostP99});
}

std::vector<Rgb8Image> real_frames() {
  std::vector<Rgb8Image> frames;
  VideoReader reader(shared_data("video/laparoscopy_720p_25fps.mp4"));
  StoredPicture picture;
  for (int i = 0; reader.next(picture); ++i)
    if (i % cases(50, 25) == 0) frames.push_back(picture.color);
  frames.push_back(read_png(shared_data("photo/laparoscopy/liver_gallbladder_1080p.png")));
  return frames;
}

TEST(HarmlessChanges, OfRenderedTissueChangeItsDepthLittle) {
  std::vector<Rgb8Image> rendered;
  for (int seed = 1; seed <= cases(2, 5); ++seed)
    rendered.push_back(
        LaparoscopyPhantom({.seed = std::uint64_t(seed), .two_tissues = true}).frame(0).image);
  add_figures("harmless changes, rendered tissue", rendered);
}

TEST(HarmlessChanges, OfRealTissueChangeItsDepthLittle) {
  REQUIRE_SHARED_DATA("video/laparoscopy_720p_25fps.mp4");
  REQUIRE_SHARED_DATA("photo/laparoscopy/liver_gallbladder_1080p.png");
  const std::vector<Rgb8Image> real = real_frames();
  add_figures("harmless changes, shared video and photograph", real);
}

}  // namespace

}  // namespace organbake
