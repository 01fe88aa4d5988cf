// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/player.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"

// Pictures as a scope's optics and its camera make them of drawn ones.

// What depth tells of a scope's picture.

namespace organbake {

// A drawn frame, from where it was drawn, and the box of the organs at rest, world mm.
struct DrawnScene {
  const Frame& frame;
  const View& view;
  Bounds organs;
};

Bounds rest_bounds(const Player& player);

// Paints what lies behind the organs in an operation: the wall of a cavity, a sphere about the
// organs that stays where it is when the view moves, dim, red-brown and folded, with fat here and
// there, lit by the light at the scope as its range asks. `picture` becomes the frame's with the
// wall in those pixels of Cover::background that have the colour `behind`: frames and truth never
// show it. The same scene gives the same bytes.
void paint_cavity_wall(const DrawnScene& scene, const std::array<std::uint8_t, 3>& behind,
                       Rgb8Image& picture);

// What a scope's lens and camera make of the light, as a preset tells it: for pictures
// that shall look like an operation's, never for measuring. All of it off unless asked for.
struct ScopePicture {
  double field = 0;        // diameter of the round field, as a share of the width; 0: the whole
  double exposure = 1;     // multiplies the light; what becomes more than 1 is white
  double haze = 0;         // 0…1: share of smoke's even light in the picture
  double bloom = 0;        // 0…1: of blown light, what spreads about it, bluish
  double sharpening = 0;   // 0…5: of what the camera adds at edges, with its dark and light halo
  double grain = 0;        // standard deviation of the noise in mid grey, sRGB levels of 255
  double aperture_mm = 0;  // of the lens: what is out of its focus, amid the picture, blurs; 0: no
  double folds = 0;        // 0…1: how dark folds and the gaps between organs are
  bool surroundings = false;  // a cavity's wall behind the organ (paint_cavity_wall())

  // But for what depth tells: what is behind the organ, in folds and out of focus.
  bool off() const {
    return field == 0 && exposure == 1 && haze == 0 && bloom == 0 && sharpening == 0 && grain == 0;
  }
  bool needs_depth() const { return surroundings || aperture_mm > 0 || folds > 0; }
  bool operator==(const ScopePicture&) const = default;
};

// Makes a picture so. The same picture gives the same bytes, on any number of threads; another has
// another noise.
void apply_scope_picture(const ScopePicture& scope, Rgb8Image& picture);
// The same with what its depth tells: folds, and what is out of focus. Planar mm, +inf where there
// is nothing.
void apply_scope_picture(const ScopePicture& scope, double focal_px,
                         const std::vector<float>& depth_mm, Rgb8Image& picture);

// Gain in linear light, then Gaussian noise in the 8-bit values; nothing at 1 and 0. `item` names
// the picture among all that have the seed.
void expose(double gain, double noise, std::uint64_t seed, std::uint64_t item, Rgb8Image& picture);

// A scope as a preset describes it: what its optics do to a picture, and its camera. Schema:
// scope-lens.schema.json.
struct ScopeLens {
  Intrinsics intrinsics;         // with the distortion; of pictures of its size
  double vignette_exponent = 0;  // light weakens as cosⁿ of the angle to the optical axis
  ScopePicture picture;          // in pictures alone, never in layers of truth

  // The same lens before a picture of another size: the middle of its own, where the shape differs.
  ScopeLens in_size(int width, int height) const;
};

// An object of width, height, fx, fy, cx, cy and perhaps distortion_k1_k2_p1_p2_k3 and
// vignette_exponent and picture, or a cameras.json, whose first camera's lens is taken. Throws
// BadDataError naming `name` and the key.
ScopeLens scope_lens_from_json(const std::string& text, const std::string& name);
std::string scope_lens_to_json(const ScopeLens& lens);
ScopeLens read_scope_lens(const std::filesystem::path& path);

// Pictures as a scope shows them, made of pictures of a pinhole in its place that is wide enough to
// hold all that the scope sees, and up to twice as fine. Where a ray of the scope meets the
// pinhole's picture is worked out once for all frames.
class LensPicture {
 public:
  // Throws BadDataError naming `name` for a lens that folds its picture over itself, and for one
  // that sees too wide for a pinhole.
  LensPicture(const ScopeLens& lens, const std::string& name);

  const Intrinsics& lens() const { return scope_.intrinsics; }  // of the pictures that come out
  const Intrinsics& pinhole() const { return pinhole_; }        // of those that are to be drawn
  // Asks for what show(DrawnScene) needs of a frame. Layers of truth do not depend on it.
  void prepare(DrawOptions& options) const;

  // Blended between four pixels, in linear light, weakened by the vignette, and made what the
  // scope's camera makes of it.
  void show(const Rgb8Image& drawn, Rgb8Image& seen) const;
  // The same of a frame that was drawn as prepare() asks, with what lies behind the organs and what
  // is out of focus, where the scope's picture has them.
  void show(const DrawnScene& scene, Rgb8Image& seen) const;
  // What each ray meets: of the four pixels round it the part that fills most of them, with planar
  // depth, normals and skin points between those that show it, as exact as these are. Points are
  // not told.
  void show(const PixelTruth& drawn, PixelTruth& seen) const;
  // In pixels of the scope's pictures; `drawn` is that of the pinhole's picture `truth`.
  void show(const Flow& drawn, const PixelTruth& truth, Flow& seen) const;

 private:
  void resample(const Rgb8Image& drawn, Rgb8Image& seen) const;
  std::vector<float> depth_seen(const std::vector<float>& drawn_mm) const;
  // The pixels round a ray that show what it meets, and their shares.
  struct Corners;
  Corners corners(std::size_t pixel, const PixelTruth& drawn) const;
  Eigen::Vector2f through_lens(const Eigen::Vector2f& pinhole_px) const;

  ScopeLens scope_;
  Intrinsics pinhole_;
  std::vector<Eigen::Vector2f> at_px_;  // of each of the scope's pixels, in the pinhole's picture
  std::vector<float> gain_;             // of each; empty without a vignette
};

// What lies off the distance that a lens is focused on becomes a disc of so many pixels across,
//   focal_px · aperture_mm · |1 / z − 1 / z₀|   (a thin lens),
// here a Gaussian as wide. z₀ is the median depth amid the picture, as a camera focuses; depth_mm
// is planar, +inf where nothing is. Nothing happens where the middle shows nothing.
void blur_out_of_focus(double aperture_mm, double focal_px, const std::vector<float>& depth_mm,
                       Rgb8Image& picture);

// Darkens skin that lies deeper than what is within some millimetres round it, as folds and the
// gaps between organs are, into which less of the light finds its way. `strength`: 0…1; depth_mm is
// planar, +inf where nothing is, which throws no shadow and gets none.
void darken_folds(double strength, double focal_px, const std::vector<float>& depth_mm,
                  Rgb8Image& picture);

}  // namespace organbake
