// SPDX-License-Identifier: Apache-2.0
// A camera's maps for a page: each texel in use as its difference from what its neighbours foretell
// (planes for depth and height, JPEG-LS's median edge detector for colour), planes of bytes by
// kind, so that deflate finds small numbers beside each other.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/stored_maps.h"

// The form: width and height (u32), first and step of depth and of height (f32), count of listed
// faces (u32); of every texel how its face is known (u8); the listed faces (u32); then planes of
// one byte a texel in use, in order: depth low and high, height low and high, green, red − green,
// blue − green, confidence, each the difference from what the neighbours foretell, modulo its size.

namespace organbake {
namespace {

// How a texel's face is known: none; as that of a neighbour that was before; or it is listed.
enum class FaceFrom : std::uint8_t { none, left, above, above_left, above_right, list };

// The texels that come before one, as far as they are in use: offsets, 0 for none.
struct Before {
  std::size_t left = 0, above = 0, above_left = 0, above_right = 0, left2 = 0, above2 = 0;
};

template <class Used>
Before before(std::size_t i, int x, int y, int width, const Used& used) {
  const auto offset = [&](bool inside, std::size_t by) { return inside && used(i - by) ? by : 0; };
  const auto row = static_cast<std::size_t>(width);
  return {offset(x > 0, 1),
          offset(y > 0, row),
          offset(x > 0 && y > 0, row + 1),
          offset(x + 1 < width && y > 0, row - 1),
          offset(x > 1, 2),
          offset(y > 1, 2 * row)};
}

inline std::size_t neighbour(FaceFrom from, const Before& b) {
  switch (from) {
    case FaceFrom::left:
      return b.left;
    case FaceFrom::above:
      return b.above;
    case FaceFrom::above_left:
      return b.above_left;
    case FaceFrom::above_right:
      return b.above_right;
    default:
      return 0;
  }
}

// A surface goes on as it came: the plane through three texels, else a line through two.
template <class Number>
Number foretold(const Number* at, const Before& b, Number last) {
  if (b.left && b.above && b.above_left)
    return static_cast<Number>(at[-std::ptrdiff_t(b.left)] + at[-std::ptrdiff_t(b.above)] -
                               at[-std::ptrdiff_t(b.above_left)]);
  if (b.above && b.above2)
    return static_cast<Number>(2 * at[-std::ptrdiff_t(b.above)] - at[-std::ptrdiff_t(b.above2)]);
  if (b.left && b.left2)
    return static_cast<Number>(2 * at[-std::ptrdiff_t(b.left)] - at[-std::ptrdiff_t(b.left2)]);
  if (b.above) return at[-std::ptrdiff_t(b.above)];
  if (b.left) return at[-std::ptrdiff_t(b.left)];
  return last;
}

// A colour lies between its neighbours', and where there is an edge on one side of it (the median
// edge detector of JPEG-LS).
inline std::uint8_t foretold_color(const std::uint8_t* at, const Before& b, std::uint8_t last) {
  if (b.left && b.above) {
    const int l = at[-std::ptrdiff_t(b.left)], a = at[-std::ptrdiff_t(b.above)];
    if (!b.above_left) return static_cast<std::uint8_t>((l + a) / 2);
    const int corner = at[-std::ptrdiff_t(b.above_left)];
    const int low = std::min(l, a), high = std::max(l, a);
    return static_cast<std::uint8_t>(corner >= high ? low : corner <= low ? high : l + a - corner);
  }
  if (b.above) return at[-std::ptrdiff_t(b.above)];
  if (b.left) return at[-std::ptrdiff_t(b.left)];
  return last;
}

inline FaceFrom face_from(const std::uint32_t* face, const Before& b) {
  for (const FaceFrom from :
       {FaceFrom::left, FaceFrom::above, FaceFrom::above_left, FaceFrom::above_right}) {
    const std::size_t by = neighbour(from, b);
    if (by && face[-std::ptrdiff_t(by)] == *face) return from;
  }
  return FaceFrom::list;
}

// visit(i, Before) for each texel in use, in order.
template <class Visit>
void for_each_used(const std::vector<std::uint32_t>& face, int width, const Visit& visit) {
  const auto used = [&](std::size_t i) { return face[i] != kNoFace; };
  const int height = static_cast<int>(face.size() / static_cast<std::size_t>(width));
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      if (used(i)) visit(i, before(i, x, y, width, used));
    }
  }
}

// Small maps are seen with texels of several pixels, whose outlines turn over by a fraction of one;
// they cost little, so they are kept as fine as a map of kUsualSide is.
constexpr double kStepsPerTexel = 128, kUsualSide = 512;
constexpr double kLargestNumber = 65535;

inline std::uint8_t coded_share(float share) {  // as the player does it
  const float positive = share > 0 ? share : 0;
  return static_cast<std::uint8_t>(
      static_cast<std::int32_t>(255 * (positive < 1 ? positive : 1) + 0.5f));
}

// Whole steps from the first value.
struct Steps {
  float first = 0, step = 1;

  static Steps over(double low, double high, double finest) {
    Steps steps;
    steps.first = static_cast<float>(low);
    steps.step = static_cast<float>(std::max(finest, (high - low) / (kLargestNumber - 2)));
    return steps;
  }
  std::uint16_t coded(float value) const {
    return static_cast<std::uint16_t>(
        std::lround(std::clamp((double{value} - first) / step, 0.0, kLargestNumber)));
  }
  float value(std::uint16_t number) const {
    return static_cast<float>(double{first} + double{step} * number);
  }
};

// The whole numbers that stand for a camera's maps, by texel.
struct MapNumbers {
  std::vector<std::uint32_t> face;
  std::vector<std::uint16_t> depth, height;
  std::array<std::vector<std::uint8_t>, 4> bytes;  // green, red − green, blue − green, confidence

  explicit MapNumbers(std::size_t texels) : face(texels, kNoFace), depth(texels), height(texels) {
    for (auto& plane : bytes) plane.resize(texels);
  }
};

struct Ranges {
  Steps depth, height;
};

Ranges ranges_of(const CameraMaps& maps, const Intrinsics& lens) {
  double near = 1e300, far = -1e300, low = 1e300, high = -1e300, sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (maps.face[i] == kNoFace || coded_share(maps.confidence[i]) == 0) continue;
    near = std::min<double>(near, maps.depth_mm[i]), far = std::max<double>(far, maps.depth_mm[i]);
    low = std::min<double>(low, maps.height_mm[i]),
    high = std::max<double>(high, maps.height_mm[i]);
    sum += maps.depth_mm[i], ++count;
  }
  if (count == 0) return {};
  const double texel_mm = sum / static_cast<double>(count) / std::sqrt(lens.fx * lens.fy);
  const double finer = std::max(1.0, kUsualSide / std::max(maps.width, maps.height));
  const double finest = texel_mm / (kStepsPerTexel * finer);
  return {Steps::over(near, far, finest), Steps::over(low, high, finest)};
}

MapNumbers numbers_of(const CameraMaps& maps, const Ranges& ranges) {
  MapNumbers numbers(maps.face.size());
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    const std::uint8_t sure = coded_share(maps.confidence[i]);
    if (maps.face[i] == kNoFace || sure == 0) continue;
    numbers.face[i] = maps.face[i];
    numbers.depth[i] = ranges.depth.coded(maps.depth_mm[i]);
    numbers.height[i] = ranges.height.coded(maps.height_mm[i]);
    std::array<std::uint8_t, 3> rgb;
    for (int k = 0; k < 3; ++k)
      rgb[k] = coded_share(std::sqrt(maps.color[i][k] > 0 ? maps.color[i][k] : 0));
    numbers.bytes[0][i] = rgb[1];
    numbers.bytes[1][i] = static_cast<std::uint8_t>(rgb[0] - rgb[1]);
    numbers.bytes[2][i] = static_cast<std::uint8_t>(rgb[2] - rgb[1]);
    numbers.bytes[3][i] = sure;
  }
  return numbers;
}

void add_wide(const MapNumbers& numbers, const std::vector<std::uint16_t>& plane, int width,
              PackedWriter& out) {
  std::vector<std::byte> low, high;
  std::uint16_t last = 0;
  for_each_used(numbers.face, width, [&](std::size_t i, const Before& b) {
    const auto rest = static_cast<std::uint16_t>(plane[i] - foretold(&plane[i], b, last));
    // Small ones of either sign are small numbers: the high bytes are then nearly all zero.
    const auto folded = static_cast<std::uint16_t>(rest & 0x8000 ? ~(rest << 1) : rest << 1);
    low.push_back(static_cast<std::byte>(folded & 255));
    high.push_back(static_cast<std::byte>(folded >> 8));
    last = plane[i];
  });
  out.add(low);
  out.add(high);
}

void add_narrow(const MapNumbers& numbers, const std::vector<std::uint8_t>& plane, int width,
                PackedWriter& out) {
  std::vector<std::byte> rest;
  std::uint8_t last = 0;
  for_each_used(numbers.face, width, [&](std::size_t i, const Before& b) {
    rest.push_back(static_cast<std::byte>(plane[i] - foretold_color(&plane[i], b, last)));
    last = plane[i];
  });
  out.add(rest);
}

void read_wide(const std::vector<std::uint32_t>& face, int width, std::size_t used,
               PackedReader& in, std::vector<std::uint16_t>& plane) {
  const auto low = in.take(used), high = in.take(used);
  std::size_t at = 0;
  std::uint16_t last = 0;
  for_each_used(face, width, [&](std::size_t i, const Before& b) {
    const auto folded = static_cast<std::uint16_t>(std::to_integer<unsigned>(low[at]) |
                                                   std::to_integer<unsigned>(high[at]) << 8);
    const auto rest = static_cast<std::uint16_t>(folded & 1 ? ~(folded >> 1) : folded >> 1);
    last = plane[i] = static_cast<std::uint16_t>(rest + foretold(&plane[i], b, last));
    ++at;
  });
}

void read_narrow(const std::vector<std::uint32_t>& face, int width, std::size_t used,
                 PackedReader& in, std::vector<std::uint8_t>& plane) {
  const auto bytes = in.take(used);
  std::size_t at = 0;
  std::uint8_t last = 0;
  for_each_used(face, width, [&](std::size_t i, const Before& b) {
    last = plane[i] = static_cast<std::uint8_t>(std::to_integer<unsigned>(bytes[at++]) +
                                                foretold_color(&plane[i], b, last));
  });
}

// Returns how many texels are in use.
std::size_t read_faces(PackedReader& in, int width, std::uint32_t listed, std::size_t faces,
                       std::vector<std::uint32_t>& face) {
  const auto from = in.take(face.size());
  const auto list = in.take(std::size_t{4} * listed);
  PackedReader next(list, "the list of faces");
  const auto used = [&](std::size_t i) { return face[i] != kNoFace; };
  std::size_t count = 0, taken = 0;
  for (std::size_t i = 0; i < face.size(); ++i) {
    const auto how = static_cast<FaceFrom>(from[i]);
    if (how == FaceFrom::none) continue;
    if (how > FaceFrom::list) in.fail("has a texel whose face is told in no known way");
    if (how == FaceFrom::list) {
      if (taken++ == listed) in.fail("lists fewer faces than it uses");
      face[i] = next.next<std::uint32_t>();
      if (face[i] >= faces) in.fail("names a face that the bundle does not have");
    } else {
      const int x = static_cast<int>(i % static_cast<std::size_t>(width)),
                y = static_cast<int>(i / static_cast<std::size_t>(width));
      const std::size_t by = neighbour(how, before(i, x, y, width, used));
      if (by == 0) in.fail("has a texel with the face of a neighbour that has none");
      face[i] = face[i - by];
    }
    ++count;
  }
  if (taken != listed) in.fail("lists more faces than it uses");
  return count;
}

std::array<float, 256> linear_table() {
  std::array<float, 256> table;
  for (int i = 0; i < 256; ++i) {
    const float root = static_cast<float>(i) / 255.0f;
    table[i] = root * root;
  }
  return table;
}

}  // namespace

std::vector<std::byte> coded_maps(const CameraMaps& maps, const Intrinsics& lens) {
  const Ranges ranges = ranges_of(maps, lens);
  const MapNumbers numbers = numbers_of(maps, ranges);
  std::vector<std::byte> from(numbers.face.size(), std::byte{0});
  std::vector<std::uint32_t> listed;
  for_each_used(numbers.face, maps.width, [&](std::size_t i, const Before& b) {
    const FaceFrom how = face_from(&numbers.face[i], b);
    from[i] = static_cast<std::byte>(how);
    if (how == FaceFrom::list) listed.push_back(numbers.face[i]);
  });
  PackedWriter out;
  out.add(static_cast<std::uint32_t>(maps.width));
  out.add(static_cast<std::uint32_t>(maps.height));
  for (const Steps& steps : {ranges.depth, ranges.height})
    out.add(steps.first), out.add(steps.step);
  out.add(static_cast<std::uint32_t>(listed.size()));
  out.add(from);
  out.add(std::as_bytes(std::span(listed)));
  add_wide(numbers, numbers.depth, maps.width, out);
  add_wide(numbers, numbers.height, maps.width, out);
  for (const auto& plane : numbers.bytes) add_narrow(numbers, plane, maps.width, out);
  return out.take();
}

CameraMaps decoded_maps(std::span<const std::byte> bytes, const Intrinsics& lens, std::size_t faces,
                        const std::string& name) {
  PackedReader in(bytes, name);
  const auto width = in.next<std::uint32_t>(), height = in.next<std::uint32_t>();
  if (width != static_cast<std::uint32_t>(lens.width) ||
      height != static_cast<std::uint32_t>(lens.height)) {
    in.fail("is " + std::to_string(width) + " × " + std::to_string(height) + ", its camera " +
            std::to_string(lens.width) + " × " + std::to_string(lens.height) + " pixels");
  }
  const std::uint64_t texels = std::uint64_t{width} * height;
  if (texels > bytes.size()) in.fail("claims more texels than it has bytes");
  Ranges ranges;
  for (Steps* steps : {&ranges.depth, &ranges.height}) {
    steps->first = in.next<float>(), steps->step = in.next<float>();
    if (!std::isfinite(steps->first) || !(steps->step > 0) || !std::isfinite(steps->step))
      in.fail("has a range that is not finite");
  }
  const auto listed = in.next<std::uint32_t>();
  MapNumbers numbers(static_cast<std::size_t>(texels));
  const std::size_t used = read_faces(in, lens.width, listed, faces, numbers.face);
  read_wide(numbers.face, lens.width, used, in, numbers.depth);
  read_wide(numbers.face, lens.width, used, in, numbers.height);
  for (auto& plane : numbers.bytes) read_narrow(numbers.face, lens.width, used, in, plane);
  in.end();
  const std::array<float, 256> linear = linear_table();
  CameraMaps maps = background_maps(lens.width, lens.height);
  for (std::size_t i = 0; i < numbers.face.size(); ++i) {
    if (numbers.face[i] == kNoFace) continue;
    maps.depth_mm[i] = ranges.depth.value(numbers.depth[i]);
    maps.height_mm[i] = ranges.height.value(numbers.height[i]);
    const std::uint8_t green = numbers.bytes[0][i];
    maps.color[i] = {linear[static_cast<std::uint8_t>(numbers.bytes[1][i] + green)], linear[green],
                     linear[static_cast<std::uint8_t>(numbers.bytes[2][i] + green)]};
    maps.confidence[i] = static_cast<float>(numbers.bytes[3][i]) / 255.0f;
  }
  maps.face = std::move(numbers.face);
  check_maps(maps, faces, name);
  return maps;
}

}  // namespace organbake
