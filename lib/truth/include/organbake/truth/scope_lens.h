// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "organbake/geometry/camera.h"
#include "organbake/truth/scope_picture.h"

namespace organbake {

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

}  // namespace organbake
