// SPDX-License-Identifier: Apache-2.0
// Instruments, lit from the eye, hidden where tissue is nearer: finishing/solids.cpp, four rays a
// pixel.
struct Hit {
  float along;
  vec3 normal;
  float most_facing;
  vec3 color;
};

void hit_sphere(vec3 d, vec3 center, float radius, vec3 color, inout Hit hit) {
  float a = dot(d, d), b = dot(d, center);
  vec3 across = center - d * (b / a);
  float discriminant = a * (radius * radius - dot(across, across));
  if (discriminant < 0.0) return;
  float t = (b - sqrt(discriminant)) / a;
  if (t > near_mm && t < hit.along) hit = Hit(t, (t * d - center) / radius, 1.0, color);
}

void hit_capsule(vec3 d, vec3 from, vec3 to, float radius, vec3 color, inout Hit hit) {
  hit_sphere(d, from, radius, color, hit);
  float length_mm = length(to - from);
  if (!(length_mm > 0.0)) return;
  hit_sphere(d, to, radius, color, hit);
  vec3 axis = (to - from) / length_mm, across = d - axis * dot(axis, d);
  vec3 from_eye = -from + axis * dot(axis, from);
  float a = dot(across, across), b = dot(across, from_eye);
  if (!(a > 0.0)) return;
  vec3 apart = from_eye - across * (b / a);
  float discriminant = a * (radius * radius - dot(apart, apart));
  if (discriminant < 0.0) return;
  float t = (-b - sqrt(discriminant)) / a, height = dot(axis, t * d - from);
  if (t > near_mm && t < hit.along && height >= 0.0 && height <= length_mm)
    hit = Hit(t, (t * d - from - axis * height) / radius, sqrt(a) / length(d), color);
}

void hit_plate(vec3 d, vec3 a, vec3 b, vec3 c, float radius, vec3 color, inout Hit hit) {
  vec3 normal = cross(b - a, c - a);
  if (dot(normal, normal) == 0.0) return;
  normal = normalize(normal);
  float facing = dot(normal, d);
  if (facing == 0.0) return;
  vec3 outward = facing < 0.0 ? normal : -normal;
  float t = (dot(outward, a) + radius) / dot(outward, d);
  vec3 p = t * d;
  if (!(t > near_mm && t < hit.along) || dot(cross(normal, b - a), p - a) < 0.0 ||
      dot(cross(normal, c - b), p - b) < 0.0 || dot(cross(normal, a - c), p - c) < 0.0)
    return;
  hit = Hit(t, outward, 1.0, color);
}

vec3 shade(Hit hit, vec3 d) {
  float facing = max(0.0, -dot(hit.normal, normalize(d)));
  float middle = min(1.0, facing / hit.most_facing), squared = middle * middle;
  float eighth = squared * squared * squared * squared, aside = 1.0 - middle;
  float by_32 = (eighth * eighth) * (eighth * eighth), bright = 0.3 + 0.7 * facing;
  float shine = sqrt(dot(hit.color, vec3(1.0 / 3.0)));
  if (at_scope)
    return min(hit.color * hit.color * (0.03 + kSteelLit * middle * squared * facing) +
                   shine * aside * squared * kTissueMirrored +
                   (0.25 + shine) * (by_32 * by_32) * (by_32 * by_32) * bright,
               1.0);
  float lamp = 0.06 + (0.35 + 0.55 * facing) * middle * squared + 0.35 * aside * aside * aside;
  return min(hit.color * lamp + shine * 0.6 * by_32 * bright, 1.0);
}

void finish(ivec2 at) {
  if (!in_tool_box()) return;
  float tissue = depth_at(at), tissue_mm = tissue < 1.0 ? tissue * reach : 1e30, depth = 1e30;
  vec3 sum = vec3(0.0);
  float rays = 0.0;
  for (int ray = 0; ray < 4; ++ray) {
    vec3 d = sight_at(vec2(at) + 0.25 + 0.5 * vec2(ray & 1, ray >> 1));
    Hit hit = Hit(1e30, vec3(0.0), 1.0, vec3(0.0));
    for (int k = 0; k < tool_count; ++k) {
      vec4 a = tool(k, 0), b = tool(k, 1), c = tool(k, 2);
      vec3 color = tool(k, 3).rgb;
      hit_capsule(d, a.xyz, b.xyz, a.w, color, hit);
      if (b.w == 0.0) continue;
      hit_capsule(d, b.xyz, c.xyz, a.w, color, hit);
      hit_capsule(d, c.xyz, a.xyz, a.w, color, hit);
      hit_plate(d, a.xyz, b.xyz, c.xyz, a.w, color, hit);
    }
    if (!(hit.along < tissue_mm) || hit.along >= 1e30) continue;
    sum += shade(hit, d);
    depth = min(depth, hit.along);
    rays += 1.0;
  }
  if (rays == 0.0) return;
  vec3 mixed = 0.25 * sum + (1.0 - 0.25 * rays) * linear_of(shown.rgb);
  shown = vec4(floor(srgb_of(mixed) * 255.0 + 0.5) / 255.0, kCoverSolid / 255.0);
  gl_FragDepth = min(depth / reach, 0.9999999);
}
