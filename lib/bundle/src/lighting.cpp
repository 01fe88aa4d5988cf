// SPDX-License-Identifier: Apache-2.0
// The light of a bundle: its sums on the skin (a sky, distant lamps, and gloss by the half-way
// vector, Blinn 1977) and lighting.json. The schema that is written is the oldest that can hold the
// light, so that older players read all that they can show.
#include "organbake/bundle/lighting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/bundle/json_fields.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr const char* kLightingSchema = "organbake/lighting/1";
constexpr const char* kScopeSchema = "organbake/lighting/2";
constexpr const char* kGrainSchema = "organbake/lighting/3";
constexpr const char* kFadeSchema = "organbake/lighting/4";
constexpr double kBrightest = 1e6, kSharpest = 1e5;
constexpr std::int64_t kMostLamps = 16, kMostLobes = 4;

Vector3d light_from(const JsonField& field) {
  const Vector3d light = field.vector3();
  if (light.minCoeff() < 0 || light.maxCoeff() > kBrightest) field.fail("needs RGB of 0…1e6");
  return light;
}

Vector3d direction_from(const JsonField& field) {
  const Vector3d direction = field.vector3();
  const double length = direction.stableNorm();
  if (!(length > 1e-9 && length < 1e9)) field.fail("is no direction: its length is 0 or too large");
  return direction / length;
}

// Of red, green and blue each a share.
Vector3d shares_from(const JsonField& field) {
  const Vector3d shares = field.vector3();
  if (shares.minCoeff() < 0 || shares.maxCoeff() > 1) field.fail("needs RGB of 0…1");
  return shares;
}

ScopeLight scope_from(const JsonField& field) {
  field.allow_only({"offset_mm", "reference_mm", "beam_half_angle_rad", "gain"});
  constexpr double kFarthestOffset_mm = 1000;
  ScopeLight scope;
  scope.offset_mm = field["offset_mm"].vector3();
  if (!(scope.offset_mm.norm() <= kFarthestOffset_mm))
    field["offset_mm"].fail("lies more than 1000 mm from the lens");
  scope.reference_mm = field["reference_mm"].number(0, 1e4);
  scope.beam_half_angle_rad = field["beam_half_angle_rad"].number(0.05, 1.5);
  scope.gain = field["gain"].number(1e-3, 1e3);
  return scope;
}

SkinFinish finish_from(const JsonField& field) {
  field.allow_only(
      {"relief_slope", "relief_mm", "softness", "rim", "grain", "grain_mm", "border_fade_rad"});
  SkinFinish finish;
  finish.relief_slope = field["relief_slope"].number(0, 1);
  finish.relief_mm = field["relief_mm"].number(0.1, 100);
  finish.softness = shares_from(field["softness"]);
  finish.rim = field["rim"].number(0, 1);
  if (const auto grain = field.find("grain")) {
    finish.grain = shares_from(*grain);
    finish.grain_mm = field["grain_mm"].number(0.01, 100);
  }
  field.read("border_fade_rad", 0, 1, finish.border_fade_rad);
  return finish;
}

void add_scope(const Lighting& lighting, Json& json) {
  if (lighting.scope) {
    const ScopeLight& scope = *lighting.scope;
    json["scope"] = {{"offset_mm", to_json(scope.offset_mm)},
                     {"reference_mm", scope.reference_mm},
                     {"beam_half_angle_rad", scope.beam_half_angle_rad},
                     {"gain", scope.gain}};
  }
  if (lighting.finish == SkinFinish()) return;
  const SkinFinish& finish = lighting.finish;
  json["finish"] = {{"relief_slope", finish.relief_slope},
                    {"relief_mm", finish.relief_mm},
                    {"softness", to_json(finish.softness)},
                    {"rim", finish.rim}};
  if (finish.border_fade_rad > 0) json["finish"]["border_fade_rad"] = finish.border_fade_rad;
  if (finish.grain.isZero(0)) return;
  json["finish"]["grain"] = to_json(finish.grain);
  json["finish"]["grain_mm"] = finish.grain_mm;
}

const char* schema_of(const Lighting& lighting) {
  if (lighting.finish.border_fade_rad > 0) return kFadeSchema;
  if (!lighting.finish.grain.isZero(0)) return kGrainSchema;
  return lighting.scope || !(lighting.finish == SkinFinish()) ? kScopeSchema : kLightingSchema;
}

}  // namespace

int SkinFinish::border_fade_px(double focal_px) const {
  return static_cast<int>(
      std::lround(std::min<double>(kWidestFade_px, border_fade_rad * focal_px)));
}

Vector3d Lighting::diffuse(const Vector3d& normal) const {
  Vector3d light = ambient_below + (ambient_above - ambient_below) * (0.5 + 0.5 * normal.dot(up));
  for (const Lamp& lamp : lamps) light += lamp.color * std::max(0.0, normal.dot(lamp.toward));
  return light;
}

Vector3d Lighting::glossy(const Vector3d& normal, const Vector3d& toward_eye) const {
  Vector3d light = Vector3d::Zero();
  for (const Lamp& lamp : lamps) {
    if (normal.dot(lamp.toward) <= 0) continue;
    const double cosine = normal.dot((lamp.toward + toward_eye).normalized());
    if (cosine <= 0) continue;
    const double log_cosine = std::log(cosine);
    double share = 0;
    for (const Lobe& lobe : gloss) share += lobe.strength * std::exp(lobe.exponent * log_cosine);
    light += lamp.color * share;
  }
  return light;
}

std::vector<Lighting::Lobe> wet_gloss() { return {{6, 900}, {0.05, 12}}; }

std::string lighting_to_json(const Lighting& lighting) {
  Json lamps = Json::array(), gloss = Json::array();
  for (const Lighting::Lamp& lamp : lighting.lamps)
    lamps.push_back({{"toward", to_json(lamp.toward)}, {"color", to_json(lamp.color)}});
  for (const Lighting::Lobe& lobe : lighting.gloss)
    gloss.push_back({{"strength", lobe.strength}, {"exponent", lobe.exponent}});
  Json json = {{"schema", schema_of(lighting)},
               {"ambient",
                {{"above", to_json(lighting.ambient_above)},
                 {"below", to_json(lighting.ambient_below)},
                 {"up", to_json(lighting.up)}}},
               {"lamps", lamps},
               {"gloss", gloss}};
  add_scope(lighting, json);
  return json_text(json);
}

Lighting lighting_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema({kLightingSchema, kScopeSchema, kGrainSchema, kFadeSchema});
  const bool for_scope = document["schema"].text() != kLightingSchema;
  Lighting lighting;
  const JsonField ambient = document["ambient"];
  lighting.ambient_above = light_from(ambient["above"]);
  lighting.ambient_below = light_from(ambient["below"]);
  lighting.up = direction_from(ambient["up"]);
  const JsonField lamps = document["lamps"], gloss = document["gloss"];
  if (lamps.size() > kMostLamps) lamps.fail("holds more than 16 lamps");
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const JsonField lamp = lamps.at(i);
    lighting.lamps.push_back({direction_from(lamp["toward"]), light_from(lamp["color"])});
  }
  if (gloss.size() > kMostLobes) gloss.fail("holds more than 4 lobes");
  for (std::size_t i = 0; i < gloss.size(); ++i) {
    const JsonField lobe = gloss.at(i);
    lighting.gloss.push_back(
        {lobe["strength"].number(0, kBrightest), lobe["exponent"].number(1, kSharpest)});
  }
  if (for_scope) {
    if (const auto scope = document.find("scope")) lighting.scope = scope_from(*scope);
    if (const auto finish = document.find("finish")) lighting.finish = finish_from(*finish);
  }
  double brightest = lighting.ambient_above.maxCoeff() + lighting.ambient_below.maxCoeff();
  for (const Lighting::Lamp& lamp : lighting.lamps) brightest += lamp.color.maxCoeff();
  if (!(brightest > 0)) document.fail("has no light at all");
  return lighting;
}

}  // namespace organbake
