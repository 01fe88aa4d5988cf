// SPDX-License-Identifier: Apache-2.0
// Blood on skin, before instruments are drawn; a hook's smoke, after that: finishing/wounds.cpp.
uniform highp sampler2D solids;  // four texels each, in the view's frame, mm
uniform int solid_count;
uniform vec4 solid_box;  // pixels
uniform vec4 view_lens;
uniform int smoke, at_scope;
uniform vec3 light_mm;  // from the eye, the view's frame
uniform float reach;

float rising(float low, float high, float value) {
  float t = clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

vec3 through_smoke(vec3 sight, float depth_mm, vec3 behind) {
  float clear = 1.0;
  for (int k = 0; k < solid_count; ++k) {
    vec4 puff = texelFetch(solids, table_at(4 * k), 0);
    float share = texelFetch(solids, table_at(4 * k + 1), 0).w;
    vec3 off = sight * (dot(sight, puff.xyz) / dot(sight, sight)) - puff.xyz;
    float far2 = dot(off, off) / (puff.w * puff.w);
    float before = clamp(0.5 + 0.5 * (depth_mm - puff.z) / puff.w, 0.0, 1.0);
    if (far2 < 1.0) clear *= 1.0 - share * before * (1.0 - far2) * (1.0 - far2);
  }
  return mix(vec3(kSmokeRed, kSmokeGreen, kSmokeBlue), behind, clear);
}

vec3 under_blood(vec3 place, vec3 skin) {
  float height = 0.0;
  bool deep = false;
  vec3 normal = vec3(0.0);
  for (int k = 0; k < solid_count; ++k) {
    vec4 from = texelFetch(solids, table_at(4 * k), 0), to = texelFetch(solids, table_at(4 * k + 1), 0);
    vec3 axis = to.xyz - from.xyz, way = place - from.xyz;
    float square = max(dot(axis, axis), 1e-12), along = clamp(dot(way, axis) / square, 0.0, 1.0);
    vec3 aside = way - along * axis, down_wall = texelFetch(solids, table_at(4 * k + 3), 0).xyz;
    float radius = mix(from.w, to.w, along), down = dot(down_wall, aside), farthest = radius;
    if (down > 0.0) {
      float cosine2 = down * down / dot(aside, aside), cosine4 = cosine2 * cosine2;
      farthest *= 1.0 + (1.0 / kBloodBelow - 1.0) * cosine4 * cosine4;
    } else {
      aside -= (1.0 - kBloodAbove) * down * down_wall;
    }
    float own = radius * (1.0 - dot(aside, aside) / (farthest * farthest));
    if (!(own > height)) continue;
    height = own;
    deep = down > kBloodPool_mm;
    normal = normalize(texelFetch(solids, table_at(4 * k + 2), 0).xyz + kBloodBulge * aside / farthest -
                       (to.w - from.w) / square * axis);
  }
  float covers = 1.0 - exp(-height / kBloodClear_mm), shine = 0.0;
  if (at_scope == 1 && !deep && height > 0.0) {
    vec3 half_way = normalize(normalize(light_mm - place) - normalize(place));
    shine = rising(kBloodDull, kBloodShiny, dot(half_way, normal)) * rising(1.0, 4.0, height * view_lens.x / place.z);
  }
  return mix(skin, vec3(kBloodRed, kBloodGreen, kBloodBlue) * skin.r + kBloodShine * shine, covers);
}

void finish(ivec2 at) {
  if (any(lessThan(gl_FragCoord.xy, solid_box.xy)) || any(greaterThan(gl_FragCoord.xy, solid_box.zw))) return;
  float depth = depth_at(at);
  bool open = depth >= 1.0;
  if (open && smoke == 0) return;
  vec3 sight = vec3((vec2(at) + 0.5 - view_lens.zw) / view_lens.xy, 1.0), was = linear_of(shown.rgb);
  vec3 now = smoke == 1 ? through_smoke(sight, open ? 1e30 : depth * reach, was)
                        : under_blood(depth * reach * sight, was);
  if (now != was) shown.rgb = floor(srgb_of(now) * 255.0 + 0.5) / 255.0;
}
