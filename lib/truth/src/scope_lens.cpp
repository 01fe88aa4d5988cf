// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/scope_lens.h"

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/warp/view.h"

namespace organbake {
namespace {

constexpr const char* kScopeLensSchema = "organbake/scope-lens/1";

}  // namespace

ScopeLens ScopeLens::in_size(int width, int height) const {
  ScopeLens other = *this;
  Intrinsics& lens = other.intrinsics;
  const double across = double(width) / lens.width, down = double(height) / lens.height;
  lens.fx *= across, lens.cx *= across, lens.fy *= down, lens.cy *= down;
  lens.width = width, lens.height = height;
  return other;
}

ScopeLens scope_lens_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  ScopeLens scope;
  if (json.is_object() && json.contains("cameras")) {
    const CameraSet set = cameras_from_json(text, name);
    if (set.cameras.empty()) document["cameras"].fail("holds no camera whose lens could be taken");
    scope.intrinsics = set.cameras.front().intrinsics;
    return scope;
  }
  if (!json.is_object()) document.fail("is no object: write width, height, fx, fy, cx and cy");
  document.allow_only({"schema", "width", "height", "fx", "fy", "cx", "cy",
                       "distortion_k1_k2_p1_p2_k3", "vignette_exponent"});
  if (document.find("schema")) document.require_schema(kScopeLensSchema);
  constexpr double kMostExponent = 100;
  scope.intrinsics = intrinsics_from_json(document, kLargestSide_px);
  if (const auto n = document.find("vignette_exponent"))
    scope.vignette_exponent = n->number(0, kMostExponent);
  return scope;
}

std::string scope_lens_to_json(const ScopeLens& scope) {
  Json json = {{"schema", kScopeLensSchema}};
  json.update(intrinsics_to_json(scope.intrinsics));
  if (scope.vignette_exponent != 0) json["vignette_exponent"] = scope.vignette_exponent;
  return json_text(json);
}

ScopeLens read_scope_lens(const std::filesystem::path& path) {
  return scope_lens_from_json(read_text_file(path), path.string());
}

}  // namespace organbake
