// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/register/straight_photo.h"

#include <algorithm>

#include "organbake/formats/camera_files.h"
#include "organbake/formats/lens_files.h"
#include "organbake/geometry/camera.h"
#include "organbake/shading/undistort.h"

namespace organbake {

Intrinsics lens_of_photo(const std::filesystem::path& file, const std::string& name,
                         const Rgb8Image& image, const RunContext& context) {
  const Intrinsics lens = read_intrinsics(file, name, image.width, image.height);
  check_lens_of_picture(lens, image.width, image.height, file);
  if (const std::string told = told_of_fisheye(lens); !told.empty()) context.info(told);
  return lens;
}

PhotoToRegister straight_photo(PhotoToRegister photo) {
  const Intrinsics lens = photo.intrinsics;
  if (lens.model != LensModel::fisheye) return photo;
  photo.intrinsics = pinhole_of(lens);
  if (photo.mask.width == 0) {
    photo.mask = Rgb8Image(lens.width, lens.height);
    std::fill(photo.mask.pixels.begin(), photo.mask.pixels.end(), std::uint8_t{255});
  }
  // Of another size than the lens they are left for register_photo() to refuse.
  const auto straight = [&](Rgb8Image& picture) {
    if (picture.width == lens.width && picture.height == lens.height)
      picture = undistorted(picture, lens, photo.intrinsics);
  };
  straight(photo.image);
  straight(photo.mask);
  for (PointPair& pair : photo.pairs)
    pair.pixel = project(photo.intrinsics, unproject(lens, pair.pixel));
  return photo;
}

PosedCamera camera_as_taken(const RegisteredPhoto& registered, const Intrinsics& lens) {
  if (lens.model != LensModel::fisheye) return registered.camera;
  PosedCamera camera = registered.camera;
  const double focal_scale = camera.intrinsics.fx / pinhole_of(lens).fx;
  camera.intrinsics = lens;
  camera.intrinsics.fx *= focal_scale;
  camera.intrinsics.fy *= focal_scale;
  return camera;
}

}  // namespace organbake
