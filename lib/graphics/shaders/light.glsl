// SPDX-License-Identifier: Apache-2.0
// The skin lit anew, as lib/warp's light/ does: by the world's light, or by one at the scope.
uniform int light;  // 0: as baked, 1: the world's, 2: at the scope
uniform vec3 above, below, up;
uniform int lamps;
uniform vec3 lamp_toward[16], lamp_color[16];
uniform int lobes;
uniform vec2 lobe[4];  // strength, exponent
uniform mat3 world_from_view;

// The light at the scope, ScopeShading.
uniform vec4 hill_phase[4], hill_slope[4];  // the slope's w: the wave's length
uniform vec4 hill_variance;
uniform vec4 drops;                // per mm, lean, inverse lit², lean²; WetFilm::Drops
uniform vec4 film;                 // strength, alpha², FilmReach
uniform vec2 sheen[2];             // strength, alpha²
uniform vec3 scope_light, scope_forward;
uniform vec3 scope;                // full, inverse tan² half, inverse pixel
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
float slope_of_wave_at(float turns) {
  return 8.0 * (1.0 - 4.0 * abs(turns - floor(turns + 0.5)));
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

// A point strewn near a place: wet_film.cpp.
float chance(uint h, int which) {
  return float(h * 0x9e3779b1u >> (8 * which) & 255u) * (1.0 / 127.5) - 1.0;
}

// The film, as wet_film.cpp has it: the slopes that a pixel lacks to mirror the lamp.
vec3 lacking_at(vec3 n, vec3 m, vec3 h, vec3 slopes) {
  float on_n = dot(n, h), both = (on_n + dot(m, h)) / (1.0001 + dot(m, n));
  float inverse = 1.0 / max(on_n, 0.1);
  return inverse * (h - both * n) + (inverse * (2.0 * on_n - both) - 1.0 - dot(m, slopes)) * m +
         slopes;
}

// A whole film's lobe.
float light_of_film(float share, float lost, float lacks2) {
  float full = share * film.x / kBlown, k2 = sqrt(max(full, 1.0)), k = sqrt(k2);
  float cut = at_most_1(4.0 * lost / film.y), alpha2 = film.y * (1.0 + cut * 4.0 * (k - 1.0));
  float wide = alpha2 + 4.0 * lost;
  float over_blown = (full + cut * (full / (k2 * k2) - full)) * alpha2 / wide;
  float ratio = wide / (wide + lacks2), squared = ratio * ratio;
  return at_most_1(over_blown * squared * squared);
}

float wetter_by(float height) {
  float t = clamp(height, 0.0, 1.0);
  return kWetBumps * t * t * (3.0 - 2.0 * t);
}

float light_of_drops(vec3 m, vec3 p, vec3 lacks, float height, vec3 rises, float dry, float turns,
                     float pixel) {
  const uvec3 kAxes = uvec3(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
  float soft = max(kSoftEnds * pixel, kEdge), reach = 1.0 - 0.5 * kJitter, sum = 0.0;
  vec3 low = floor(p - 0.5), within = p - low - (0.5 - 0.5 * kJitter);
  uvec3 cube = uvec3(ivec3(low)) * kAxes;
  for (int k = 0; k < 8; ++k) {
    uvec3 step3 = uvec3(k & 1, k >> 1 & 1, k >> 2);
    uint h = cube.x + cube.y + cube.z + step3.x * kAxes.x + step3.y * kAxes.y + step3.z * kAxes.z;
    h = (h ^ (h >> 15)) * 0x85ebca6bu;
    h ^= h >> 13;
    vec3 d = within - vec3(step3) -
             kJitter / 1023.0 * vec3(float(h & 1023u), float(h >> 10 & 1023u), float(h >> 20 & 1023u));
    float own = clamp(wetter_by(height - dot(rises, d)) + dry + chance(h, 3), 0.0, 1.0);
    vec3 leaning = drops.y * vec3(chance(h, 0), chance(h, 1), chance(h, 2));
    vec3 e = lacks + leaning + turns * d;
    float on_m = dot(leaning, m), outward = dot(d, m), out2 = outward * outward;
    float e_on_m = on_m + turns * outward;
    float lit = positive(1.0 - drops.z * (dot(e, e) - e_on_m * e_on_m));
    float size2 = kDrop * own * at_most_1(kGrows * lit) * positive(1.0 - out2 / (reach * reach));
    float drawn2 = max(size2, 0.25 * soft * soft), drawn = sqrt(drawn2);
    float along = dot(d, leaning) - on_m * outward, lean2 = dot(leaning, leaning) - on_m * on_m;
    float farthest = kRun / drops.y * drawn;
    float at = clamp(along / (lean2 + 1e-9), -farthest, farthest);
    float away2 = dot(d, d) - out2 + at * (at * lean2 - 2.0 * along);
    float inside = at_most_1(positive(0.5 + (drawn2 - away2) / (2.0 * drawn * soft)));
    float kept = size2 / drawn2;
    sum += (1.0 - sum) * kept * inside * inside * (3.0 - 2.0 * inside);
  }
  return sum;
}

float mean_of_drops(float lacks2, float wet) {
  float t = at_most_1(0.5 * positive(wet + 1.0)), beyond = positive(t - 0.5);
  float own = t * t - beyond * beyond, wide = 1.05 + 1.8 * drops.w;
  float lit = positive(1.0 - lacks2 * drops.z / wide) / wide;
  return own * (0.72 - 0.11 * own) * at_most_1(kGrows * lit);
}

float gloss_by_film(vec3 n, vec3 half_way, SkinAt skin, float depth, float share) {
  vec3 m = skin.rest_normal * inversesqrt(dot(skin.rest_normal, skin.rest_normal) + 1e-20);
  float pixels_per_mm = scope.z / depth;
  vec3 hills = vec3(0.0), rises = vec3(0.0);
  float lost = 0.0, hill = 0.0;
  for (int k = 3; k >= 0; --k) {
    float phase = dot(hill_phase[k].xyz, skin.rest_mm) + hill_phase[k].w;
    float shown = resolved(hill_slope[k].w * pixels_per_mm);
    if (k > 0) {
      float shifted = phase + 0.25 + kAskew * hill;
      hill += wave_at(shifted);
      rises += slope_of_wave_at(shifted) * (hill_phase[k].xyz + kAskew * rises);
    }
    hills += shown * wave_at(phase) * hill_slope[k].xyz;
    lost += (1.0 - shown * shown) * hill_variance[k];
  }
  vec3 lacks = lacking_at(n, m, half_way, hills);
  if (drops.z == 0.0) {
    float bent = skin.bend * (1.0 / pixels_per_mm + kBridges_mm);
    return kBlown * light_of_film(share, lost + bent * bent, dot(lacks, lacks));
  }
  float pixel = drops.x / pixels_per_mm;
  float seen = at_most_1(positive(2.0 - pixel / (1.0 - 0.5 * kJitter)));
  float height = 0.5 + kPatches * (hill - kUpperHills), dry = kDriest - kCrease * skin.bend;
  rises *= kPatches / drops.x;
  float turns = (1.0 / depth + skin.bend) / drops.x;
  float mean = mean_of_drops(dot(lacks, lacks) + 2.0 * lost, dry + wetter_by(height));
  float each = light_of_drops(m, drops.x * skin.rest_mm, lacks, height, rises - dot(rises, m) * m, dry,
                              turns, pixel);
  return kBlown * at_most_1(share * film.x) * (mean + seen * (each - mean));
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
      sum += bright * sheen[k].x * sheen[k].y * sheen[k].y / (d * d + 1e-12) * kSheen;
  }
  float shows = seen < 0.0 ? 0.0
                           : at_most_1(positive((near - film.z) * film.w)) *
                                 at_most_1(8.0 * positive(facing));
  if (shows > 0.0)
    sum += shows * gloss_by_film(n, h, skin, depth, share) *
           max(white - (drops.z > 0.0 ? sum : vec3(0.0)), 0.0);
  return sum;
}

// A colour × its weight, lit anew; the weight is white's.
vec3 lit(vec3 color, float white, float depth, SkinAt skin) {
  if (light == 0) return color;
  mat3x4 turn = turn_at(skin);
  vec3 normal = (turn * skin.rest_normal).xyz;
  if (drops.z == 0.0) skin.bend += max(turn[0].w, 0.0);  // drops lie as at rest
  vec3 ray = world_from_view * vec3((gl_FragCoord.xy - lens.zw) / lens.xy, 1.0);
  vec3 before = diffuse(normalize(skin.rest_normal));
  if (light == 2)
    return lit_by_scope(color * min(1.0 / before, kLargestGain), white, normal, skin, ray, depth);
  vec3 n = normalize(normal);
  return color * min(diffuse(n) / before, kLargestGain) + white * glossy(n, -normalize(ray));
}
