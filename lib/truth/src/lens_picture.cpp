// SPDX-License-Identifier: Apache-2.0
// A picture through the lens of a scope: for each of its pixels the place in a pinhole's picture
// that the ray meets is found once, and pictures, layers and flow are looked up there. And the
// lens's own JSON.
#include "organbake/truth/lens_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr const char* kScopeLensSchema = "organbake/scope-lens/1";
constexpr const char* kScopePictureSchema = "organbake/scope-lens/2";

ScopePicture picture_from(const JsonField& field) {
  field.allow_only({"field", "exposure", "haze", "bloom", "sharpening", "grain", "aperture_mm",
                    "folds", "surroundings"});
  ScopePicture picture;
  field.read("field", 0.05, 2, picture.field);
  field.read("exposure", 0.01, 100, picture.exposure);
  field.read("haze", 0, 1, picture.haze);
  field.read("bloom", 0, 1, picture.bloom);
  field.read("sharpening", 0, 5, picture.sharpening);
  field.read("grain", 0, 50, picture.grain);
  field.read("aperture_mm", 0, 5, picture.aperture_mm);
  field.read("folds", 0, 1, picture.folds);
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
  document.read("vignette_exponent", 0, kMostExponent, scope.vignette_exponent);
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

namespace {

using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kFiner = 2;
constexpr int kMargin_px = 2;  // of the pinhole's picture beyond what the scope sees

// z = 1, through the centres of the scope's pixels.
std::vector<Vector3d> scope_rays(const Intrinsics& lens, const std::string& name) {
  constexpr double kUndone_px = 0.01;
  const int width = lens.width;
  std::vector<Vector3d> rays(std::size_t(width) * lens.height);
  std::vector<std::uint8_t> folded(lens.height, 0);
  parallel_for(0, lens.height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const Vector2d pixel(x + 0.5, y + 0.5);
      const Vector3d ray = unproject(lens, pixel);
      rays[std::size_t(y) * width + x] = ray;
      const Vector2d again = ray.allFinite() ? project(lens, ray) : Vector2d(-1e9, -1e9);
      // Where a circle farther out is drawn farther in, a pixel shows two places.
      const Vector2d farther =
          ray.allFinite() ? project(lens, {1.001 * ray.x(), 1.001 * ray.y(), 1}) : again;
      const Vector2d middle(lens.cx, lens.cy);
      folded[y] |= !((again - pixel).norm() < kUndone_px) ||
                   (farther - middle).norm() < (again - middle).norm();
    }
  });
  const auto bad = std::find(folded.begin(), folded.end(), 1);
  if (bad != folded.end())
    throw BadDataError(name, "the distortion folds the picture over itself in row " +
                                 std::to_string(bad - folded.begin()) +
                                 ": its coefficients are of another lens or another order than "
                                 "k1, k2, p1, p2, k3");
  return rays;
}

// Wide enough for all rays, and finer than the scope's picture is at its middle, so that outlines
// are known to a fraction of the scope's pixels; less so where it would become too large.
Intrinsics pinhole_round(const std::vector<Vector3d>& rays, const Intrinsics& lens,
                         const std::string& name) {
  Vector2d low = Vector2d::Constant(1e9), high = -low;
  for (const Vector3d& ray : rays) {
    low = low.cwiseMin(ray.head<2>());
    high = high.cwiseMax(ray.head<2>());
  }
  constexpr double kNarrowest_deg = 0.1, kWidest_deg = 170, kDegrees = 180 / std::numbers::pi;
  const double field_deg = kDegrees * std::max(std::atan(high.x()) - std::atan(low.x()),
                                               std::atan(high.y()) - std::atan(low.y()));
  if (!(field_deg >= kNarrowest_deg && field_deg <= kWidest_deg))
    throw BadDataError(name, "has a field of " + to_text(field_deg, 1) +
                                 " degrees; a flat picture shows 0.1 to 170: check fx and fy, "
                                 "which are focal lengths in pixels");
  const Vector2d focal_px(lens.fx, lens.fy);
  const Vector2d span_px = (high - low).cwiseProduct(focal_px);
  constexpr double kRoom_px = kLargestSide_px - 2 * kMargin_px - 2;  // two for whole pixels
  const double finer = std::min(kFiner, kRoom_px / span_px.maxCoeff());
  if (!(finer >= 1))
    throw BadDataError(name, "sees so wide that a picture without its distortion would have " +
                                 to_text(span_px.x(), 0) + " × " + to_text(span_px.y(), 0) +
                                 " pixels; take a smaller size");
  Intrinsics pinhole;
  pinhole.fx = finer * lens.fx, pinhole.fy = finer * lens.fy;
  pinhole.cx = kMargin_px - std::floor(low.x() * pinhole.fx);
  pinhole.cy = kMargin_px - std::floor(low.y() * pinhole.fy);
  pinhole.width = static_cast<int>(std::ceil(high.x() * pinhole.fx) + pinhole.cx) + kMargin_px;
  pinhole.height = static_cast<int>(std::ceil(high.y() * pinhole.fy) + pinhole.cy) + kMargin_px;
  return pinhole;
}

// sRGB of linear light by a table, to a quarter of an 8-bit step.
std::uint8_t encoded(float linear) {
  constexpr int kSteps = 1 << 14;
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> values(kSteps + 1);
    for (int i = 0; i <= kSteps; ++i) values[i] = srgb8_from_linear(static_cast<float>(i) / kSteps);
    return values;
  }();
  return table[static_cast<int>(std::clamp(linear, 0.0f, 1.0f) * kSteps + 0.5f)];
}

// The pixel whose centre lies to the upper left of a place that lies inside.
struct Cell {
  int x, y;
  float u, v;  // 0…1 from that centre to the next

  explicit Cell(const Vector2f& px)
      : x(static_cast<int>(std::floor(px.x() - 0.5f))),
        y(static_cast<int>(std::floor(px.y() - 0.5f))),
        u(px.x() - 0.5f - static_cast<float>(x)),
        v(px.y() - 0.5f - static_cast<float>(y)) {}
  std::array<float, 4> shares() const {
    return {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
  }
};

}  // namespace

struct LensPicture::Corners {
  // Of what the ray meets: of the parts that the four pixels show, the one that fills most of them,
  // which follows an outline more closely than the pixel that the ray goes through.
  std::size_t own = 0;
  std::array<std::size_t, 4> at{};
  std::array<float, 4> share{};  // sums to 1; of those that show something else 0
};

LensPicture::LensPicture(const ScopeLens& lens, const std::string& name) : scope_(lens) {
  const std::vector<Vector3d> rays = scope_rays(lens.intrinsics, name);
  pinhole_ = pinhole_round(rays, lens.intrinsics, name);
  at_px_.reserve(rays.size());
  for (const Vector3d& ray : rays) at_px_.push_back(project(pinhole_, ray).cast<float>());
  if (lens.vignette_exponent == 0) return;
  gain_.reserve(rays.size());
  for (const Vector3d& ray : rays)
    gain_.push_back(static_cast<float>(std::pow(1 / ray.norm(), lens.vignette_exponent)));
}

void LensPicture::resample(const Rgb8Image& drawn, Rgb8Image& seen) const {
  const Intrinsics& k = scope_.intrinsics;
  seen.width = k.width, seen.height = k.height;
  seen.pixels.resize(3 * at_px_.size());
  const auto& linear = linear_from_srgb8();
  parallel_for(0, k.height, [&](int y) {
    for (int x = 0; x < k.width; ++x) {
      const std::size_t i = std::size_t(y) * k.width + x;
      const Cell cell(at_px_[i]);
      const std::array<float, 4> share = cell.shares();
      const std::uint8_t* const at[4] = {drawn.at(cell.x, cell.y), drawn.at(cell.x + 1, cell.y),
                                         drawn.at(cell.x, cell.y + 1),
                                         drawn.at(cell.x + 1, cell.y + 1)};
      const float gain = gain_.empty() ? 1 : gain_[i];
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int n = 0; n < 4; ++n) sum += share[n] * linear[at[n][c]];
        seen.pixels[3 * i + c] = encoded(gain * sum);
      }
    }
  });
}

void LensPicture::show(const Rgb8Image& drawn, Rgb8Image& seen) const {
  resample(drawn, seen);
  apply_scope_picture(scope_.picture, seen);
}

void LensPicture::prepare(DrawOptions& options) const {
  if (scope_.picture.surroundings) options.background = DrawOptions::kCavity;
  options.keep_depth |= scope_.picture.needs_depth();
}

// Folds darken and what is out of focus blurs as the scope sees them, of a quarter of the pixels
// that were drawn.
void LensPicture::show(const DrawnScene& scene, Rgb8Image& seen) const {
  const ScopePicture& scope = scope_.picture;
  if (scope.surroundings) {
    Rgb8Image drawn;
    paint_cavity_wall(scene, DrawOptions::kCavity, drawn);
    resample(drawn, seen);
  } else {
    resample(scene.frame.color, seen);
  }
  if (!scope.needs_depth()) return apply_scope_picture(scope, seen);
  apply_scope_picture(scope, scope_.intrinsics.fx, depth_seen(scene.frame.depth_mm), seen);
}

std::vector<float> LensPicture::depth_seen(const std::vector<float>& drawn_mm) const {
  std::vector<float> depth_mm(at_px_.size());
  for (std::size_t i = 0; i < depth_mm.size(); ++i)
    depth_mm[i] = drawn_mm[static_cast<std::size_t>(at_px_[i].y()) * pinhole_.width +
                           static_cast<std::size_t>(at_px_[i].x())];
  return depth_mm;
}

LensPicture::Corners LensPicture::corners(std::size_t pixel, const PixelTruth& drawn) const {
  constexpr float kJump = 0.01f;  // of the depth, from a pixel to the next: another part
  const Vector2f& px = at_px_[pixel];
  const Cell cell(px);
  const std::array<float, 4> share = cell.shares();
  const std::size_t first = std::size_t(cell.y) * drawn.width + cell.x;
  Corners corners;
  corners.at = {first, first + 1, first + drawn.width, first + drawn.width + 1};
  const auto same = [&](std::size_t a, std::size_t b) {
    return drawn.label[a] == drawn.label[b] && drawn.solid_at(a) == drawn.solid_at(b) &&
           !(std::abs(drawn.depth_mm[a] - drawn.depth_mm[b]) > kJump * drawn.depth_mm[b]);
  };
  float sum = 0;
  int nearest = 0;
  for (int own = 0; own < 4; ++own) {
    std::array<float, 4> with{};
    float all = 0;
    for (int n = 0; n < 4; ++n)
      if (same(corners.at[n], corners.at[own])) all += with[n] = share[n];
    if (all < sum || (all == sum && share[own] <= share[nearest])) continue;
    sum = all, nearest = own;
    corners.own = corners.at[own], corners.share = with;
  }
  for (float& part : corners.share) part /= sum;
  return corners;
}

void LensPicture::show(const PixelTruth& drawn, PixelTruth& seen) const {
  const Intrinsics& k = scope_.intrinsics;
  const std::size_t pixels = at_px_.size();
  seen.width = k.width, seen.height = k.height;
  seen.bound.resize(pixels);
  seen.organ.resize(drawn.organ.empty() ? 0 : pixels);
  seen.depth_mm.resize(pixels);
  seen.label.resize(pixels);
  seen.point.clear();
  seen.normal.resize(drawn.normal.empty() ? 0 : pixels);
  seen.solid.resize(drawn.solid.empty() ? 0 : pixels);
  constexpr std::size_t kGrain = 1 << 13;
  parallel_each(std::size_t{0}, pixels, kGrain, [&](std::size_t i) {
    const Corners c = corners(i, drawn);
    seen.label[i] = drawn.label[c.own];
    if (!seen.organ.empty()) seen.organ[i] = drawn.organ[c.own];
    if (!seen.solid.empty()) seen.solid[i] = drawn.solid[c.own];
    seen.depth_mm[i] = drawn.depth_mm[c.own];
    if (std::isfinite(seen.depth_mm[i])) {  // of a plane 1/z is linear in the picture
      float inverse = 0;
      for (int n = 0; n < 4; ++n)
        if (c.share[n] > 0) inverse += c.share[n] / drawn.depth_mm[c.at[n]];
      seen.depth_mm[i] = 1 / inverse;
    }
    if (!seen.normal.empty()) {
      Vector3f sum = Vector3f::Zero();
      for (int n = 0; n < 4; ++n) sum += c.share[n] * drawn.normal[c.at[n]];
      const float length = sum.norm();
      seen.normal[i] = length > 0 ? Vector3f(sum / length) : Vector3f(Vector3f::Zero());
    }
    BoundPixel& bound = seen.bound[i];
    bound = drawn.bound[c.own];
    bound.depth_mm = seen.depth_mm[i];
    if (!bound.has_skin()) return;
    float sum = 0;
    BoundPixel mean = bound;
    mean.b1 = mean.b2 = mean.height_mm = 0;
    for (int n = 0; n < 4; ++n) {
      const BoundPixel& other = drawn.bound[c.at[n]];
      if (other.face != bound.face || drawn.organ_at(c.at[n]) != drawn.organ_at(c.own)) continue;
      sum += c.share[n];
      mean.b1 += c.share[n] * other.b1;
      mean.b2 += c.share[n] * other.b2;
      mean.height_mm += c.share[n] * other.height_mm;
    }
    if (!(sum > 0)) return;
    mean.b1 /= sum, mean.b2 /= sum, mean.height_mm /= sum;
    bound = mean;
  });
}

// Beyond what the scope sees its distortion says nothing: there a picture goes on as at its border.
Vector2f LensPicture::through_lens(const Vector2f& px) const {
  const Vector2f inside(std::clamp(px.x(), 0.0f, static_cast<float>(pinhole_.width)),
                        std::clamp(px.y(), 0.0f, static_cast<float>(pinhole_.height)));
  const Vector3d ray = unproject(pinhole_, inside.cast<double>());
  return project(scope_.intrinsics, ray).cast<float>() + (px - inside);
}

void LensPicture::show(const Flow& drawn, const PixelTruth& truth, Flow& seen) const {
  const Intrinsics& k = scope_.intrinsics;
  const std::size_t pixels = at_px_.size();
  seen.px.resize(pixels);
  seen.seen.resize(pixels);
  parallel_for(0, k.height, [&](int y) {
    for (int x = 0; x < k.width; ++x) {
      const std::size_t i = std::size_t(y) * k.width + x;
      const Corners c = corners(i, truth);
      seen.px[i].setZero();
      seen.seen[i] = 0;
      if (truth.label[c.own] == 0) continue;
      Vector2f moved = at_px_[i];
      for (int n = 0; n < 4; ++n) moved += c.share[n] * drawn.px[c.at[n]];
      const Vector2f lands = through_lens(moved);
      seen.px[i] = lands - Vector2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      float shown = 0;
      for (int n = 0; n < 4; ++n) shown += drawn.seen[c.at[n]] ? c.share[n] : 0;
      seen.seen[i] = shown > 0.5f && lands.x() >= 0 && lands.y() >= 0 &&
                     lands.x() < static_cast<float>(k.width) &&
                     lands.y() < static_cast<float>(k.height);
    }
  });
}

}  // namespace organbake
