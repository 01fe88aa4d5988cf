// SPDX-License-Identifier: Apache-2.0
// Both sides of a border are blended by the share of the pixel that the skin in front covers, by
// the stretches into which the border falls: finishing/post_process.h (Reshetov 2009, "Morphological
// antialiasing"). What a stretch longer than kLongest does beyond it, nobody sees.
uniform highp usampler2D edges;
const int kLongest = 96;

bool has(bool column, bool second, ivec2 at) {
  if (!within(at)) return false;
  uint bit = (second ? 2u : 1u) << (column ? 2 : 0);
  return (texelFetch(edges, at, 0).r & bit) != 0u;
}
bool in_front(ivec2 a, ivec2 b) {
  bool column = a.x == b.x;
  return b.x > a.x || b.y > a.y ? has(column, false, a) : has(column, true, b);
}

// A border of pairs; column: they lie in columns, and the border runs to the right.
int count_pairs(bool column, bool second, ivec2 from, ivec2 way) {
  int n = 0;
  while (n < kLongest && has(column, second, from + n * way)) ++n;
  return n;
}

float rise_of(bool column, bool second, ivec2 first, int pairs, int ends, ivec2 way) {
  ivec2 across = column ? ivec2(0, 1) : ivec2(1, 0);
  ivec2 next = first + across * (second ? -ends : ends);
  int before = count_pairs(column, second, next - way, -way);
  int after = count_pairs(column, second, next + pairs * way, way);
  float l = float(pairs), sum = 0.0, sides = 0.0;
  if (before > 0) sum += 0.25 * l * l / (float(before) * float(before + pairs)), sides += 1.0;
  if (after > 0) sum += 0.25 * l * l / (float(after) * float(after + pairs)), sides += 1.0;
  return sides > 0.0 ? min(sum / sides, 0.75) : 0.5;
}

float slope_area(float from, float half_length) {
  float to = min(from + 1.0, half_length);
  return from < to ? (to - from) / 2.0 * (1.0 - (to + from) / (2.0 * half_length)) : 0.0;
}
float bow_integral(float u, float pairs, float rise) {
  return 0.5 * pairs * u * (0.5 - rise + rise * u * u / 3.0);
}

// Of the pixel behind (x) and in front (y).
vec2 areas_of(int pairs, int before, int after, float rise, int i) {
  float l = float(pairs), at = float(i);
  if (before != after) {
    float left = slope_area(at, 0.5 * l), right = slope_area(l - 1.0 - at, 0.5 * l);
    return vec2((before > 0 ? left : 0.0) + (after > 0 ? right : 0.0),
                (before < 0 ? left : 0.0) + (after < 0 ? right : 0.0));
  }
  float from = 2.0 * at / l - 1.0, to = 2.0 * (at + 1.0) / l - 1.0;
  float crossing = rise > 0.5 ? sqrt(1.0 - 0.5 / rise) : 0.0;
  float a = clamp(from, -crossing, crossing), b = clamp(to, -crossing, crossing);
  float beyond = bow_integral(a, l, rise) - bow_integral(b, l, rise);
  float within_it = bow_integral(to, l, rise) - bow_integral(from, l, rise) + beyond;
  return before > 0 ? vec2(within_it, beyond) : vec2(beyond, within_it);
}

// By how much more of the pixel, or less, the skin in front covers, for the border at a pair.
float change_at(ivec2 at, ivec2 pair, bool column, bool second) {
  if (!has(column, second, pair)) return 0.0;
  ivec2 way = column ? ivec2(1, 0) : ivec2(0, 1), across = column ? ivec2(0, 1) : ivec2(1, 0);
  int back = count_pairs(column, second, pair - way, -way);
  int pairs = back + 1 + count_pairs(column, second, pair + way, way);
  ivec2 first = pair - back * way, last = first + (pairs - 1) * way;
  ivec2 to_skin = second ? across : ivec2(0), to_open = second ? ivec2(0) : across;
  int before = int(in_front(first - way + to_open, first + to_open)) -
               int(in_front(first + to_skin, first - way + to_skin));
  int after = int(in_front(last + way + to_open, last + to_open)) -
              int(in_front(last + to_skin, last + way + to_skin));
  if (before == 0 && after == 0) return 0.0;
  float rise = before == after ? rise_of(column, second, first, pairs, before, way) : 0.0;
  vec2 areas = areas_of(pairs, before, after, rise, back);
  bool is_skin = at == pair + to_skin;
  return float(int(254.0 * (is_skin ? -areas.y : areas.x))) / 254.0;
}

void finish(ivec2 at) {
  float change = 0.0;
  for (int k = 0; k < 8; ++k) {
    bool column = k < 4, second = (k & 1) != 0;
    ivec2 pair = (k & 2) != 0 ? at : at - (column ? ivec2(0, 1) : ivec2(1, 0));
    float one = change_at(at, pair, column, second);
    if (abs(one) > abs(change)) change = one;
  }
  if (change == 0.0) return;
  vec3 others = vec3(0.0);
  float count = 0.0;
  for (int k = 0; k < 4; ++k) {
    ivec2 beside = at + (k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5));
    if (!(change > 0.0 ? in_front(beside, at) : in_front(at, beside))) continue;
    others += linear_of(color_at(beside).rgb);
    count += 1.0;
  }
  if (count == 0.0) return;
  vec3 light = abs(change) / count * others + (1.0 - abs(change)) * linear_of(shown.rgb);
  shown.rgb = floor(srgb_of(light) * 255.0 + 0.5) / 255.0;
}
