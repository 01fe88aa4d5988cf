// SPDX-License-Identifier: Apache-2.0
// What instruments do to skin before they are drawn: they darken what they nearly touch and the dents
// that they press, and by the light at the scope they throw shadows and are mirrored in its wet film:
// finishing/tool_shadows.cpp.
struct Capsule {
  vec3 from, to;
  float radius, color;
  vec3 pressed;
};

vec3 place_at(ivec2 at) { return depth_at(at) * reach * sight_at(vec2(at) + 0.5); }

// 0 where the skin breaks off.
vec3 normal_at(ivec2 at) {
  float here = depth_at(at);
  for (int k = 0; k < 4; ++k) {
    ivec2 beside = at + kNormalReach * (k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5));
    if (!within(beside) || !(abs(depth_at(beside) - here) < kSteepestNormal * here)) return vec3(0.0);
  }
  ivec2 right = ivec2(kNormalReach, 0), down = ivec2(0, kNormalReach);
  vec3 normal = cross(place_at(at + down) - place_at(at - down), place_at(at + right) - place_at(at - right));
  float size = length(normal);
  return size > 0.0 ? normal / size : vec3(0.0);
}

// The gap between a ray and a capsule's surface (x), and where along the ray (y), mm.
vec2 passing(vec3 p, vec3 d, float length_mm, Capsule capsule) {
  vec3 axis = capsule.to - capsule.from, r = p - capsule.from;
  float e = dot(axis, axis), f = dot(axis, r), c = dot(d, r), b = dot(d, axis);
  float denominator = e - b * b;
  float s = denominator > 1e-6 * max(e, 1.0) ? clamp((b * f - c * e) / denominator, 0.0, length_mm) : 0.0;
  float t = e > 1e-12 ? clamp((b * s + f) / e, 0.0, 1.0) : 0.0;
  s = clamp(b * t - c, 0.0, length_mm);
  return vec2(length(r + s * d - t * axis) - capsule.radius, s);
}

float kept_in_dent(vec3 way, Capsule capsule, float gap) {
  float depth = length(capsule.pressed);
  float below = clamp((dot(way, capsule.pressed) / depth - capsule.radius) / depth + 1.0, 0.0, 1.0);
  float shade = kDarkestDent * depth / (depth + 0.5 * capsule.radius) * below * (2.0 - below);
  return 1.0 - shade * rising(kDentReach * (capsule.radius + depth), 0.0, gap);
}

// What is kept of the skin's light (x), and what is mirrored in it (y); what a dent keeps (z).
void shade_by(Capsule capsule, vec3 place, vec3 normal, inout vec3 shade) {
  vec3 axis = capsule.to - capsule.from, way = place - capsule.from, toward = light_mm - place;
  way -= clamp(dot(way, axis) / max(dot(axis, axis), 1e-12), 0.0, 1.0) * axis;  // from the axis
  float gap = max(0.0, length(way) - capsule.radius);
  if (capsule.pressed != vec3(0.0)) shade.z = min(shade.z, kept_in_dent(way, capsule, gap));
  if (gap >= kShadeReach_mm) return;
  float range = max(length(toward), 1.0);
  vec2 shadow = passing(place, toward / range, range, capsule);
  float soft = kLeastSoft_mm + kLampRadius_mm * shadow.y / range;
  float touches = rising(kShadeReach_mm, 0.4 * kShadeReach_mm, gap);
  float kept = at_scope ? 1.0 - kDarkestShadow * touches * rising(soft, -soft, shadow.x) : 1.0;
  float near = kOccludedNear_mm + kOccludedByRadius * capsule.radius;
  shade.x = min(shade.x, kept * (1.0 - kOccluded * touches * exp(-gap / near)));
  if (!at_scope) return;
  vec3 sight = normalize(place);
  float facing = -dot(sight, normal);
  if (!(facing > 0.0)) return;
  vec2 image = passing(place, sight + 2.0 * facing * normal, kMirrorReach_mm, capsule);
  float fresnel = kWaterMirror + (1.0 - kWaterMirror) * pow(1.0 - facing, 5.0);
  float seen = rising(0.3, -0.3, image.x) * (1.0 - image.y / kMirrorReach_mm) * capsule.color;
  shade.y = max(shade.y, min(fresnel, 0.4) * seen);
}

void finish(ivec2 at) {
  if (!in_tool_box() || is_open(shown) || depth_at(at) >= 1.0) return;
  vec3 place = place_at(at), normal = normal_at(at);
  vec3 shade = vec3(1.0, 0.0, 1.0);
  for (int k = 0; k < tool_count; ++k) {
    vec4 a = tool(k, 0), b = tool(k, 1), c = tool(k, 2);
    vec3 steel = tool(k, 3).rgb;
    float color = kSteelLit * dot(steel, steel) / 3.0;
    shade_by(Capsule(a.xyz, b.xyz, a.w, color, b.w == 0.0 ? c.xyz : vec3(0.0)), place, normal, shade);
    if (b.w == 0.0) continue;
    shade_by(Capsule(b.xyz, c.xyz, a.w, color, vec3(0.0)), place, normal, shade);
    shade_by(Capsule(c.xyz, a.xyz, a.w, color, vec3(0.0)), place, normal, shade);
  }
  shade.xy *= shade.z;
  if (shade.x > 0.995 && shade.y < 0.001) return;
  vec3 kept = shade.x / (1.0 - kTissueMirrored * (1.0 - shade.x));
  shown.rgb = floor(srgb_of(kept * linear_of(shown.rgb) + shade.y) * 255.0 + 0.5) / 255.0;
}
