// SPDX-License-Identifier: Apache-2.0
// The skin lit anew, as lib/warp's light/ does: by the world's light, or by one at the scope.
uniform int light;  // 0: as baked, 1: the world's, 2: at the scope
uniform vec3 above, below, up;
uniform int lamps;
uniform vec3 lamp_toward[16], lamp_color[16];
uniform int lobes;
uniform vec2 lobe[4];  // strength, exponent
uniform mat3 world_from_view;
uniform vec4 view_lens;  // fx, fy, cx, cy

// The light at the scope, ScopeShading.
uniform vec4 hill_phase[4], hill_slope[4];  // the slope's w: the wave's length
uniform vec4 hill_variance;
uniform vec3 bumps;                // per mm, slope, rough
uniform vec2 film[4], sheen[2];    // strength, alpha²
uniform vec3 scope_light, scope_forward;
uniform vec4 scope;                // full, inverse tan² half, inverse pixel, least cosine
uniform vec3 softness, grain;
uniform float rim, grain_mm;
uniform highp isampler3D noise;

vec3 diffuse(vec3 n) {
  vec3 sum = below + (above - below) * (0.5 * (1.0 + dot(n, up)));
  for (int k = 0; k < lamps; ++k) sum += lamp_color[k] * max(0.0, dot(n, lamp_toward[k]));
  return max(sum, kLeastLight);
}

vec3 glossy(vec3 n, vec3 toward_eye) {
  vec3 sum = vec3(0.0);
  for (int k = 0; k < lamps; ++k) {
    float cosine = dot(n, normalize(lamp_toward[k] + toward_eye));
    if (dot(n, lamp_toward[k]) <= 0.0 || cosine <= 0.0) continue;
    for (int l = 0; l < lobes; ++l) sum += lamp_color[k] * (lobe[l].x * pow(cosine, lobe[l].y));
  }
  return sum;
}

float positive(float v) { return max(v, 0.0); }
float at_most_1(float v) { return min(v, 1.0); }
// Of what is so many pixels long, how much a pixel can show: all from four on.
float resolved(float pixels) { return at_most_1(positive(0.5 * pixels - 1.0)); }
float wave_at(float turns) {
  float t = turns - floor(turns + 0.5);
  return 8.0 * t * (1.0 - 2.0 * abs(t));
}

float grain_at(vec3 p) {
  ivec3 at = ivec3(floor(vec3(p.x + 0.31 * p.y, p.y + 0.27 * p.z, p.z - 0.29 * p.x)));
  return float(texelFetch(noise, (at & (kGrainSide - 1)).zyx, 0).r);
}

vec3 grained(vec3 color, vec3 p, float depth) {
  float per_mm = kPerGrain / grain_mm, px = scope.z * grain_mm / depth;
  float a = resolved(px) * grain_at(per_mm * p);
  per_mm /= kOctaveStep;
  float b = resolved(px * kOctaveStep) * grain_at(per_mm * p.yzx);
  per_mm /= kOctaveStep;
  float c = resolved(px * kOctaveStep * kOctaveStep) * grain_at(per_mm * p.zxy);
  float part = 0.65 / kGrainDeviation, tone = part * (a + 0.9 * b + 0.7 * c);
  float hue = part * 0.4 * (b - a);
  return color * max(1.0 + grain * (tone + vec3(-0.5, 0.3, 0.6) * hue), 0.15);
}

// A place among the cells round points strewn in space: nearest_cell.h.
struct Cell {
  vec3 from;
  float border;
  uint hash;
};
float chance(Cell cell, int which) {
  return float(cell.hash * 0x9e3779b1u >> (8 * which) & 255u) * (1.0 / 127.5) - 1.0;
}
Cell nearest_cell(vec3 p) {
  const uvec3 kAxes = uvec3(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
  const float kJitter = 0.8;
  vec3 low = floor(p - 0.5), within = p - low - (0.5 - 0.5 * kJitter);
  uvec3 at = uvec3(ivec3(low)) * kAxes;
  Cell cell = Cell(vec3(0.0), 99.0, 0u);
  float first = 99.0, second = 99.0;
  for (int k = 0; k < 8; ++k) {
    uvec3 step3 = uvec3(k & 1, k >> 1 & 1, k >> 2);
    uint h = at.x + at.y + at.z + step3.x * kAxes.x + step3.y * kAxes.y + step3.z * kAxes.z;
    h = (h ^ (h >> 15)) * 0x85ebca6bu;
    h ^= h >> 13;
    vec3 d = within - vec3(step3) -
             kJitter / 1023.0 * vec3(float(h & 1023u), float(h >> 10 & 1023u), float(h >> 20 & 1023u));
    float d2 = dot(d, d);
    bool nearer = d2 < first;
    second = min(second, nearer ? first : d2);
    if (nearer) cell.from = d, cell.hash = h, first = d2;
  }
  cell.border = second - first;
  return cell;
}

// Slopes of hills and bumps at rest, and the variance of those that a pixel cannot show; wet.
void film_at(vec3 p, vec3 m, float pixels_per_mm, out vec3 slope, out float lost, out float wet) {
  slope = vec3(0.0), lost = 0.0;
  float hill = 0.0;
  for (int k = 0; k < 4; ++k) {
    float phase = dot(hill_phase[k].xyz, p) + hill_phase[k].w;
    float share = resolved(hill_slope[k].w * pixels_per_mm);
    hill += wave_at(phase + 0.25);
    slope += share * wave_at(phase) * hill_slope[k].xyz;
    lost += (1.0 - share * share) * hill_variance[k];
  }
  Cell cell = nearest_cell(bumps.x * p);
  vec3 along = cell.from - dot(cell.from, m) * m;
  float seen = resolved(pixels_per_mm / bumps.x);
  float height = bumps.y * (0.9 + 0.4 * hill);
  slope += -kDome * seen * height * along +
           kLean * seen * height * vec3(chance(cell, 0), chance(cell, 1), chance(cell, 2));
  float pixel = bumps.x / pixels_per_mm, across = height * kDome * pixel;
  lost += (1.0 - seen * seen) * height * height + seen * across * across / 12.0;
  float patch_share = at_most_1(positive(0.5 + kPatches * hill));
  float own = at_most_1(positive(kWetBumps * patch_share + chance(cell, 3)));
  float end = kEdge + kSoftEnds * pixel;
  float wall = at_most_1(cell.border / end);
  float drop = at_most_1(positive((kDrop - dot(cell.from, cell.from)) / end));
  float border = min(drop, wall), edge = border * border * (3.0 - 2.0 * border);
  wet = patch_share * kOfBumps * (1.0 - seen) + seen * own * edge;
}

float gloss_by_film(vec3 n, vec3 half_way, vec3 rest_normal, vec3 rest_mm, float depth,
                    float share) {
  vec3 m = rest_normal * inversesqrt(dot(rest_normal, rest_normal) + 1e-20), g;
  float lost, wet;
  film_at(rest_mm, m, scope.z / depth, g, lost, wet);
  g -= dot(g, m) * m;
  g -= dot(g, n) / (1.001 + dot(m, n)) * (m + n);
  vec3 q = n - g;
  float along = positive(dot(q, half_way)), cosine2 = along * along / (dot(q, q) + 1e-20);
  float mirrored = 0.0;
  for (int k = 0; k < 4; ++k) {
    float wide = film[k].y + 4.0 * lost, ratio = wide / (1.0 - cosine2 * (1.0 - wide) + 1e-12);
    mirrored += film[k].x * film[k].y / wide * (ratio * ratio) * (ratio * ratio);
  }
  return (1.0 - bumps.z * (1.0 - wet)) * min(share * mirrored, kBlown);
}

vec3 lit_by_scope(vec3 albedo, float white, vec3 normal, SkinAt skin, vec3 ray, float depth) {
  if (max(max(grain.r, grain.g), grain.b) > 0.0 && grain_mm * scope.z > 2.0 * depth)
    albedo = grained(albedo, skin.rest_mm, depth);
  vec3 l = scope_light - depth * ray;
  float inverse_range = inversesqrt(max(dot(l, l), kNearest_mm2));
  l *= inverse_range;
  vec3 e = -normalize(ray);
  float ahead = positive(-dot(l, scope_forward)), ahead2 = ahead * ahead;
  float beam = ahead2 / (ahead2 + (1.0 - ahead2) * scope.y + 1e-12);
  float share = scope.x * beam * inverse_range * inverse_range;
  float seen = dot(normal, e);
  vec3 n = normal * ((seen < 0.0 ? -1.0 : 1.0) * inversesqrt(dot(normal, normal) + 1e-20));
  vec3 h = l + e;
  h *= inversesqrt(dot(h, h) + 1e-20);
  float facing = dot(n, l), near = dot(n, h);
  float grazing = 1.0 - at_most_1(dot(n, e)), grazing2 = grazing * grazing;
  float bright = white * share;
  vec3 sum = albedo * share * max((facing + softness) / (1.0 + softness), 0.0) +
             bright * kSurroundings * rim * grazing2 * grazing2 * grazing;
  for (int k = 0; k < 2; ++k) {
    float d = 1.0 - near * near * (1.0 - sheen[k].y);
    if (near > 0.0)
      sum += bright * sheen[k].x * sheen[k].y * sheen[k].y / (d * d + 1e-12) *
             vec3(kSheenRed, kSheenGreen, kSheenBlue);
  }
  float shows = seen < 0.0 ? 0.0
                           : at_most_1(positive((near - scope.w) / (kFade * (1.0 - scope.w)))) *
                                 at_most_1(8.0 * positive(facing));
  if (scope.w < 1.0 && shows > 0.0)
    sum += white * shows * gloss_by_film(n, h, skin.rest_normal, skin.rest_mm, depth, share);
  return sum;
}

// A colour × its weight, lit anew; the weight is white's.
vec3 lit(vec3 color, float white, int face, float b1, float b2, float depth, SkinAt skin) {
  if (light == 0) return color;
  vec3 normal = turned(skin.rest_normal, face, b1, b2);
  vec3 ray = world_from_view * vec3((gl_FragCoord.xy - view_lens.zw) / view_lens.xy, 1.0);
  vec3 before = diffuse(normalize(skin.rest_normal));
  if (light == 2)
    return lit_by_scope(color * min(1.0 / before, kLargestGain), white, normal, skin, ray, depth);
  vec3 n = normalize(normal);
  return color * min(diffuse(n) / before, kLargestGain) + white * glossy(n, -normalize(ray));
}
