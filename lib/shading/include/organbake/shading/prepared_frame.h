// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/image/picture.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Whether neighbouring rows differ far more than rows of one field do: motion between two fields.
bool is_combed(const Rgb8Image& frame);
// Keeps the upper field and interpolates the lower.
void deinterlace(StoredPicture& frame);

// Mean squared Laplacian of the green channel: falls when a frame is blurred by motion.
double sharpness(const Rgb8Image& frame);
// The side of the squares of one colour that a frame is made of: a mosaic, or a small picture that
// was enlarged by repeating its pixels; 1 of others. Up to 32.
int squares_px(const Rgb8Image& frame);
// Mean of the green channel, 0…255.
double brightness(const Rgb8Image& frame);
// Whether the brightness of a clip's frames jumps to and fro, as under a stroboscope: most frames
// differ from the one before by far more than any exposure that follows the tissue.
bool flickers(const std::vector<double>& brightness);
// Mean absolute difference of two frames' green channels (0…255); infinite when sizes differ.
double mean_difference(const Rgb8Image& a, const Rgb8Image& b);

// The size that upright() gives.
struct PixelSize {
  int width = 0, height = 0;
  bool operator==(const PixelSize&) const = default;
};
PixelSize upright_size(const StoredPicture& picture);

// The picture with square pixels (the shorter side of a pixel is divided, so that nothing is lost)
// and turned as its file asks. Throws BadDataError for an aspect that no camera has.
void make_upright(StoredPicture& picture);

enum class StereoLayout { none, side_by_side, top_bottom };

// Whether a frame holds two pictures of one scene: its halves, without their slow shading, are
// alike but for a shift (normalised correlation at low resolution).
StereoLayout find_stereo_layout(const Rgb8Image& frame);

struct FrameOptions {
  int halvings = 0;              // 0…4: of the frame's size, before anything else
  bool masks = true;             // look for the field of view, highlights and instruments
  bool piecewise_albedo = true;  // bring tissues of different colour to one albedo

  void check() const;  // throws UsageError
};

// A frame made ready to be read as shading.
struct PreparedFrame {
  Rgb8Image color;    // undistorted, of reduced size
  Intrinsics camera;  // of `color`; without distortion
  Plane intensity;    // linear, of one albedo
  Mask field;         // inside the round field of view
  Mask highlights;    // filled from around
  Mask instruments;
  Mask tissue;   // where there is depth: field without instruments
  Mask diffuse;  // where brightness is read: tissue without highlights
  bool was_combed = false;
  bool colourless = false;  // too grey for colour to tell instruments from tissue
  StereoLayout stereo = StereoLayout::none;
  int squares_px = 1;  // of two eyes: squares_px() before they were rectified
  Plane log_albedo;    // divided out of the intensity; empty when not asked for
};

// Of endoscopes, with room for wider lenses; 70 is meant to be degrees.
inline constexpr double kNarrowestView_rad = 0.05, kWidestView_rad = 2.8;

// The frame whose pixels are means of 2×2, and its camera; an odd last row or column falls away.
Rgb8Image half_size(const Rgb8Image& frame);
Intrinsics half_size(Intrinsics camera);

// A pinhole camera for frames of this size with the given horizontal field of view. Throws
// UsageError for one that is not within these bounds.
inline Intrinsics assumed_camera(int width, int height, double field_of_view_rad) {
  if (!(field_of_view_rad >= kNarrowestView_rad && field_of_view_rad <= kWidestView_rad))
    throw UsageError("the field of view is " + to_text(field_of_view_rad) + " rad; it must be in " +
                     to_text(kNarrowestView_rad) + "…" + to_text(kWidestView_rad) +
                     " (70 degrees are 1.22 rad)");
  Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * width / std::tan(0.5 * field_of_view_rad);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

// What is known of a frame before it is looked at: masks of the frame's size, or null.
struct GivenMasks {
  const Mask* instruments = nullptr;  // in the place of the search for them
  const Mask* insets = nullptr;       // InsetFinder: no part of the field of view
};

// Deinterlaces when combed, makes linear, halves, undistorts, masks. `frame` is upright with square
// pixels, or as its `camera` has it.
PreparedFrame prepare_frame(const StoredPicture& frame, const Intrinsics& camera,
                            const FrameOptions& options, const GivenMasks& given = {});

// What a camera without distortion (geometry/camera.h) would have seen in the place of `lens`,
// bilinear, a mask by its nearest pixels; what was outside the picture is black, or 0. Picture and
// lens are of one size.
[[nodiscard]] Rgb8Image undistorted(const Rgb8Image& picture, const Intrinsics& lens,
                                    const Intrinsics& pinhole);
[[nodiscard]] Plane undistorted(const Plane& plane, const Intrinsics& lens,
                                const Intrinsics& pinhole);
[[nodiscard]] Mask undistorted(const Mask& mask, const Intrinsics& lens, const Intrinsics& pinhole);

// What to say of a lens of which a part alone is used, a fisheye; "" for others.
std::string told_of_fisheye(const Intrinsics& lens);

}  // namespace organbake
