// SPDX-License-Identifier: Apache-2.0
#include "bundle/lighting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "bundle/json_fields.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr const char* kLightingSchema = "organbake/lighting/1";
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

}  // namespace

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

std::string lighting_to_json(const Lighting& lighting) {
  Json lamps = Json::array(), gloss = Json::array();
  for (const Lighting::Lamp& lamp : lighting.lamps)
    lamps.push_back({{"toward", to_json(lamp.toward)}, {"color", to_json(lamp.color)}});
  for (const Lighting::Lobe& lobe : lighting.gloss)
    gloss.push_back({{"strength", lobe.strength}, {"exponent", lobe.exponent}});
  return json_text({{"schema", kLightingSchema},
                    {"ambient",
                     {{"above", to_json(lighting.ambient_above)},
                      {"below", to_json(lighting.ambient_below)},
                      {"up", to_json(lighting.up)}}},
                    {"lamps", lamps},
                    {"gloss", gloss}});
}

Lighting lighting_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kLightingSchema);
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
  double brightest = lighting.ambient_above.maxCoeff() + lighting.ambient_below.maxCoeff();
  for (const Lighting::Lamp& lamp : lighting.lamps) brightest += lamp.color.maxCoeff();
  if (!(brightest > 0)) document.fail("has no light at all");
  return lighting;
}

}  // namespace organbake
