// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "organbake/geometry/camera.h"

namespace organbake {

// What a scope's optics do to a picture. Schema: scope-lens.schema.json.
struct ScopeLens {
  Intrinsics intrinsics;         // with the distortion; of pictures of its size
  double vignette_exponent = 0;  // light weakens as cosⁿ of the angle to the optical axis

  // The same lens before a picture of another size.
  ScopeLens in_size(int width, int height) const;
};

// An object of width, height, fx, fy, cx, cy and perhaps distortion_k1_k2_p1_p2_k3 and
// vignette_exponent, or a cameras.json, whose first camera's lens is taken. Throws BadDataError
// naming `name` and the key.
ScopeLens scope_lens_from_json(const std::string& text, const std::string& name);
std::string scope_lens_to_json(const ScopeLens& lens);
ScopeLens read_scope_lens(const std::filesystem::path& path);

}  // namespace organbake
