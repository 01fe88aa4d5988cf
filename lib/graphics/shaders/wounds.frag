// SPDX-License-Identifier: Apache-2.0
// Blood on skin, before instruments are drawn; a hook's smoke, after that: finishing/wounds.cpp.
uniform bool smoke;

vec3 through_smoke(vec3 sight, float depth_mm, vec3 behind) {
  float clear = 1.0;
  for (int k = 0; k < tool_count; ++k) {
    vec4 puff = tool(k, 0);
    float share = tool(k, 1).w;
    vec3 off = sight * (dot(sight, puff.xyz) / dot(sight, sight)) - puff.xyz;
    float far2 = dot(off, off) / (puff.w * puff.w);
    float before = clamp(0.5 + 0.5 * (depth_mm - puff.z) / puff.w, 0.0, 1.0);
    if (far2 < 1.0) clear *= 1.0 - share * before * (1.0 - far2) * (1.0 - far2);
  }
  return mix(kSmokeLight, behind, clear);
}

vec3 under_blood(vec3 place, vec3 skin) {
  float height = 0.0, shine = 0.0, weight = 0.0;
  vec3 half_way = normalize(normalize(light_mm - place) - normalize(place));
  for (int k = 0; k < tool_count; ++k) {
    vec4 from = tool(k, 0), to = tool(k, 1);
    vec3 axis = to.xyz - from.xyz, way = place - from.xyz;
    float square = max(dot(axis, axis), 1e-12), along = clamp(dot(way, axis) / square, 0.0, 1.0);
    vec3 aside = way - along * axis, down_wall = tool(k, 3).xyz;
    float radius = mix(from.w, to.w, along), down = dot(down_wall, aside), farthest = radius;
    if (down > 0.0) {
      float cosine2 = down * down / dot(aside, aside), cosine4 = cosine2 * cosine2;
      farthest *= 1.0 + (1.0 / kBloodBelow - 1.0) * cosine4 * cosine4;
    } else {
      aside -= (1.0 - kBloodAbove) * down * down_wall;
    }
    float own = radius * (1.0 - dot(aside, aside) / (farthest * farthest));
    if (!(own > 0.0)) continue;
    height = max(height, own);
    vec3 normal = tool(k, 2).xyz + kBloodBulge * aside / farthest - (to.w - from.w) / square * axis;
    float by_4 = own * own * own * own;
    weight += by_4 * by_4;
    shine += by_4 * by_4 * (1.0 - rising(0.0, kBloodPool_mm, down)) *
             rising(kBloodDull, kBloodShiny, dot(half_way, normalize(normal)));
  }
  float covers = 1.0 - exp(-height / kBloodClear_mm);
  shine *= at_scope && weight > 0.0 ? rising(1.0, 4.0, height * lens.x / place.z) / weight : 0.0;
  return mix(skin, kBlood * skin.r + kBloodShine * shine, covers);
}

void finish(ivec2 at) {
  if (!in_tool_box()) return;
  float depth = depth_at(at);
  bool open = depth >= 1.0;
  if (open && !smoke) return;
  vec3 sight = sight_at(vec2(at) + 0.5), was = linear_of(shown.rgb);
  vec3 now = smoke ? through_smoke(sight, open ? 1e30 : depth * reach, was)
                        : under_blood(depth * reach * sight, was);
  if (now != was) shown.rgb = floor(srgb_of(now) * 255.0 + 0.5) / 255.0;
}
