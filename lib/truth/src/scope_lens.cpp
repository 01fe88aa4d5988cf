// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/scope_lens.h"

#include <algorithm>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/warp/view.h"

namespace organbake {
namespace {

constexpr const char* kScopeLensSchema = "organbake/scope-lens/1";
constexpr const char* kScopePictureSchema = "organbake/scope-lens/2";

ScopePicture picture_from(const JsonField& field) {
  field.allow_only({"field", "exposure", "haze", "bloom", "sharpening", "grain", "aperture_mm",
                    "folds", "surroundings"});
  ScopePicture picture;
  const auto number = [&](const char* key, double low, double high, double& value) {
    if (const auto given = field.find(key)) value = given->number(low, high);
  };
  number("field", 0.05, 2, picture.field);
  number("exposure", 0.01, 100, picture.exposure);
  number("haze", 0, 1, picture.haze);
  number("bloom", 0, 1, picture.bloom);
  number("sharpening", 0, 5, picture.sharpening);
  number("grain", 0, 50, picture.grain);
  number("aperture_mm", 0, 5, picture.aperture_mm);
  number("folds", 0, 1, picture.folds);
  if (const auto given = field.find("surroundings")) {
    if (!given->json().is_boolean()) given->fail("is neither true nor false");
    picture.surroundings = given->json().get<bool>();
  }
  return picture;
}

Json picture_to_json(const ScopePicture& p) {
  Json json = {{"exposure", p.exposure},     {"haze", p.haze},   {"bloom", p.bloom},
               {"sharpening", p.sharpening}, {"grain", p.grain}, {"surroundings", p.surroundings}};
  if (p.field > 0) json["field"] = p.field;
  if (p.aperture_mm > 0) json["aperture_mm"] = p.aperture_mm;
  if (p.folds > 0) json["folds"] = p.folds;
  return json;
}

}  // namespace

ScopeLens ScopeLens::in_size(int width, int height) const {
  ScopeLens other = *this;
  Intrinsics& lens = other.intrinsics;
  const double scale = std::max(double(width) / lens.width, double(height) / lens.height);
  lens.fx *= scale, lens.fy *= scale;
  lens.cx = scale * lens.cx - 0.5 * (scale * lens.width - width);
  lens.cy = scale * lens.cy - 0.5 * (scale * lens.height - height);
  other.picture.field *= scale * lens.width / width;
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
                       "distortion_k1_k2_p1_p2_k3", "vignette_exponent", "picture"});
  if (document.find("schema")) document.require_schema({kScopeLensSchema, kScopePictureSchema});
  constexpr double kMostExponent = 100;
  scope.intrinsics = intrinsics_from_json(document, kLargestSide_px);
  if (const auto n = document.find("vignette_exponent"))
    scope.vignette_exponent = n->number(0, kMostExponent);
  if (const auto picture = document.find("picture")) scope.picture = picture_from(*picture);
  return scope;
}

std::string scope_lens_to_json(const ScopeLens& scope) {
  const bool plain = scope.picture == ScopePicture();
  Json json = {{"schema", plain ? kScopeLensSchema : kScopePictureSchema}};
  json.update(intrinsics_to_json(scope.intrinsics));
  if (scope.vignette_exponent != 0) json["vignette_exponent"] = scope.vignette_exponent;
  if (!plain) json["picture"] = picture_to_json(scope.picture);
  return json_text(json);
}

ScopeLens read_scope_lens(const std::filesystem::path& path) {
  return scope_lens_from_json(read_text_file(path), path.string());
}

}  // namespace organbake
