// SPDX-License-Identifier: Apache-2.0
// The truth of a picture's pixels from the samples that it was drawn of: which layers are asked
// for, where everything lay at a moment, and depth, labels, points and normals at the pixels'
// centres.
#include "organbake/truth/pixel_truth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/warp/warper.h"

namespace organbake {
namespace {

const std::vector<std::pair<std::string, bool LayerSet::*>>& layers() {
  static const std::vector<std::pair<std::string, bool LayerSet::*>> all = {
      {"depth", &LayerSet::depth}, {"flow", &LayerSet::flow}, {"normals", &LayerSet::normals},
      {"mask", &LayerSet::mask},   {"id", &LayerSet::id},     {"weight", &LayerSet::weight}};
  return all;
}

void add(const std::string& name, LayerSet& set) {
  bool known = false;
  for (const auto& [of, member] : layers()) {
    if (name != "all" && name != of) continue;
    set.*member = known = true;
  }
  if (known) return;
  std::string all;
  for (const std::string& one : layer_names()) all += one + ", ";
  throw UsageError("'" + name + "' is no layer; take any of " + all + "or all");
}

}  // namespace

const std::vector<std::string>& layer_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& layer : layers()) all.push_back(layer.first);
    return all;
  }();
  return names;
}

LayerSet layers_from(std::string_view text) {
  LayerSet set;
  while (true) {
    const std::size_t comma = text.find(',');
    add(std::string(text.substr(0, comma)), set);
    if (comma == std::string_view::npos) return set;
    text.remove_prefix(comma + 1);
  }
}

namespace {

void place_faces(const std::vector<ShellMatrix>& world, const RigidTransform& pose,
                 std::vector<Moment::Columns>& placed) {
  placed.resize(world.size());
  constexpr std::size_t kGrain = 1 << 10;
  parallel_each(std::size_t{0}, world.size(), kGrain, [&](std::size_t f) {
    ShellMatrix metric = pose.rotation * world[f];
    metric.col(0) += pose.translation;
    placed[f].topRows<3>() = metric.cast<float>();
    placed[f].row(3).setZero();
  });
}

}  // namespace

// The organ's own skin is posed where it is asked for, and where it is what was drawn.
void Moment::take(std::span<const Warper* const> organs, const View& from,
                  const std::vector<Solid>& tools, bool with_places, bool bound_as_drawn) {
  view = from;
  solids = tools;
  const RigidTransform& pose = view.camera.camera_from_world;
  skins.resize(organs.size());
  for (std::size_t o = 0; o < skins.size(); ++o) {
    const DrawnSkin drawn = organs[o]->drawn_skin();
    const bool own = drawn.cut_into == 1 || bound_as_drawn;
    Skin& skin = skins[o];
    skin.drawn_base = &drawn.base, skin.cut_into = own ? 1 : drawn.cut_into;
    skin.shell.clear(), skin.drawn_shell.clear();
    if (own || with_places)
      place_faces(own ? drawn.shell : organs[o]->shell_matrices(), pose, skin.shell);
    if (!own) place_faces(drawn.shell, pose, skin.drawn_shell);
  }
}

bool Moment::faces_eye(std::size_t organ, const BoundPixel& of_own) const {
  const Skin& skin = skins[organ];
  const bool own = skin.cut_into == 1;
  const BoundPixel point = own ? of_own : on_drawn_skin(of_own, skin.cut_into);
  const Columns& shell = own ? skin.shell[point.face] : skin.drawn_shell[point.face];
  const BaseLayer& base = *skin.drawn_base;
  const int n = static_cast<int>(base.steps);
  const float step = 1 / static_cast<float>(n);
  const float* heights = &base.height_mm[std::size_t(point.face) * base.nodes_per_face()];
  const auto node = [&](int i, int j) -> Eigen::Vector3f {
    const float height_mm = heights[base_node_index(base.steps, static_cast<std::uint32_t>(i),
                                                    static_cast<std::uint32_t>(j))];
    return shell_point(shell, step * static_cast<float>(i), step * static_cast<float>(j), height_mm)
        .head<3>();
  };
  const float u = point.b1 * static_cast<float>(n), v = point.b2 * static_cast<float>(n);
  const int i = std::clamp(static_cast<int>(u), 0, n - 1),
            j = std::clamp(static_cast<int>(v), 0, n - 1 - i);
  const bool upper = u - static_cast<float>(i) + v - static_cast<float>(j) > 1 && i + j + 2 <= n;
  const Eigen::Vector3f b = node(i + 1, j), c = node(i, j + 1),
                        a = upper ? node(i + 1, j + 1) : node(i, j);
  const Eigen::Vector3f normal = upper ? (c - a).cross(b - a) : (b - a).cross(c - a);
  return normal.dot(a + b + c) < 0;
}

namespace {

using Eigen::Vector3f;

// Along one axis of the picture: the difference across both neighbours where the skin goes on
// evenly, else to the one that lies less far off in depth.
class Tangents {
 public:
  explicit Tangents(const PixelTruth& truth) : truth_(truth) {}

  Vector3f along(std::size_t at, int place, int size, std::size_t step) const {
    const bool before = place > 0 && same(at, at - step),
               after = place + 1 < size && same(at, at + step);
    const Vector3f& here = truth_.point[at];
    const Vector3f back = before ? Vector3f(here - truth_.point[at - step]) : Vector3f::Zero();
    const Vector3f on = after ? Vector3f(truth_.point[at + step] - here) : Vector3f::Zero();
    if (!before) return on;
    if (!after) return back;
    // A step in depth that is many times the other is where skin hides skin.
    constexpr float kBreak = 4;
    const float fall = std::abs(back.z()), rise = std::abs(on.z());
    const float pixel = back.head<2>().norm() + on.head<2>().norm();
    if (fall > kBreak * rise + pixel) return on;
    if (rise > kBreak * fall + pixel) return back;
    return back + on;
  }

 private:
  bool same(std::size_t a, std::size_t b) const { return truth_.label[a] == truth_.label[b]; }

  const PixelTruth& truth_;
};

// Normals of the skin's pixels, from the places of the points that their neighbours show: what
// bends or breaks within a pixel has none of its own. Tools keep theirs.
void put_skin_normals(PixelTruth& truth) {
  const Tangents tangents(truth);
  const std::size_t width = truth.width;
  parallel_for(0, truth.height, [&](int y) {
    for (int x = 0; x < truth.width; ++x) {
      const std::size_t at = y * width + x;
      if (truth.solid_at(at) != 0) continue;
      truth.normal[at].setZero();
      if (truth.label[at] == 0) continue;
      const Vector3f right = tangents.along(at, x, truth.width, 1),
                     down = tangents.along(at, y, truth.height, width);
      Vector3f normal = down.cross(right);  // rows run down: towards the eye
      const float length = normal.norm();
      const Vector3f to_eye = -truth.point[at].normalized();
      if (!(length > 0)) {
        truth.normal[at] = to_eye;
        continue;
      }
      normal /= length;
      truth.normal[at] = normal.dot(to_eye) < 0 ? Vector3f(-normal) : normal;
    }
  });
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kWidestFill_px = 4;  // slits are four wide

// The bound pixel nearest to one that was filled; of equal ones the first.
std::optional<std::size_t> nearest_bound(const Frame& picture, const PixelTruth& truth, int x,
                                         int y) {
  std::optional<std::size_t> best;
  int nearest = (kWidestFill_px + 1) * (kWidestFill_px + 1);
  for (int v = std::max(0, y - kWidestFill_px); v <= std::min(truth.height - 1, y + kWidestFill_px);
       ++v) {
    for (int u = std::max(0, x - kWidestFill_px);
         u <= std::min(truth.width - 1, x + kWidestFill_px); ++u) {
      const std::size_t at = std::size_t(v) * truth.width + u;
      const int far = (u - x) * (u - x) + (v - y) * (v - y);
      if (far >= nearest || picture.cover[at] == Cover::filled ||
          picture.cover[at] == Cover::background || !truth.bound[at].has_skin())
        continue;
      nearest = far, best = at;
    }
  }
  return best;
}

// Pixels that the warp filled after their samples had been resolved.
void follow_fills(const Frame& picture, PixelTruth& truth) {
  struct Filled {
    std::size_t at;
    std::optional<std::size_t> from;
  };
  std::vector<Filled> filled;
  const Cover* const first = picture.cover.data();
  const Cover* const end = first + truth.pixels();
  // They are rare: the library finds the next one.
  for (const Cover* next = first; next < end; ++next) {
    next = static_cast<const Cover*>(
        std::memchr(next, static_cast<int>(Cover::filled), static_cast<std::size_t>(end - next)));
    if (!next) break;
    const auto at = static_cast<std::size_t>(next - first);
    const int x = static_cast<int>(at % truth.width), y = static_cast<int>(at / truth.width);
    filled.push_back({at, nearest_bound(picture, truth, x, y)});
  }
  for (const Filled& pixel : filled) {
    truth.bound[pixel.at] = pixel.from ? truth.bound[*pixel.from] : BoundPixel();
    truth.bound[pixel.at].weight = 0;
    if (pixel.from && !truth.organ.empty()) truth.organ[pixel.at] = truth.organ[*pixel.from];
  }
}

void put_skin(const Moment& moment, const Frame& picture, PixelTruth& truth) {
  constexpr std::size_t kGrain = 1 << 13;
  parallel_each(std::size_t{0}, truth.pixels(), kGrain, [&](std::size_t i) {
    BoundPixel& bound = truth.bound[i];
    // What the warp opened and did not fill shows nothing.
    if (picture.cover[i] == Cover::background) bound.face = BoundPixel::kNoSkin;
    const bool skin = bound.has_skin();
    truth.depth_mm[i] = skin ? bound.depth_mm : kInfinity;
    truth.label[i] = skin ? static_cast<std::uint8_t>(kFirstOrganLabel + truth.organ_at(i)) : 0;
    if (skin && !truth.point.empty()) truth.point[i] = moment.place(truth.organ_at(i), bound);
  });
}

// 1 for each pixel of a row that shows something and has a neighbour that shows nothing; beyond the
// picture lies none.
void find_border(const PixelTruth& truth, int y, std::vector<std::uint8_t>& border) {
  const std::size_t width = truth.width;
  const std::uint8_t* const row = truth.label.data() + y * width;
  const std::uint8_t* const above = y > 0 ? row - width : row;
  const std::uint8_t* const below = y + 1 < truth.height ? row + width : row;
  border.resize(width);
  const auto at = [&](std::size_t x, std::size_t left, std::size_t right) {
    const bool beside = (row[left] == 0) | (row[right] == 0) | (above[x] == 0) | (below[x] == 0);
    border[x] = (row[x] != 0) & beside;
  };
  for (std::size_t x = 1; x + 1 < width; ++x) at(x, x - 1, x + 1);
  at(0, 0, std::min<std::size_t>(1, width - 1));
  at(width - 1, width > 1 ? width - 2 : 0, width - 1);
}

// Skin beside the background that is turned away already: samples reach a little over the outline.
void trim_outline(const Moment& moment, PixelTruth& truth) {
  constexpr int kRounds = 2;
  const int width = truth.width, height = truth.height;
  if (truth.pixels() == 0) return;
  std::vector<std::vector<std::size_t>> over(height);
  for (int round = 0; round < kRounds; ++round) {
    constexpr int kRows = 16;
    parallel_pieces(0, height, kRows, [&](int first, int last) {
      std::vector<std::uint8_t> border;
      for (int y = first; y < last; ++y) {
        over[y].clear();
        find_border(truth, y, border);
        const std::uint8_t* const end = border.data() + width;
        for (const std::uint8_t* next = border.data();
             (next = std::find(next, end, std::uint8_t{1})) < end; ++next) {
          const std::size_t at =
              std::size_t(y) * width + static_cast<std::size_t>(next - border.data());
          if (!moment.faces_eye(truth.organ_at(at), truth.bound[at])) over[y].push_back(at);
        }
      }
    });
    for (const auto& row : over)
      for (const std::size_t at : row)
        truth.bound[at] = {}, truth.label[at] = 0, truth.depth_mm[at] = kInfinity;
  }
}

void put_tools(const Moment& moment, const LayerSet& layers, PixelTruth& truth) {
  truth.solid.assign(moment.solids.empty() ? 0 : truth.pixels(), 0);
  if (moment.solids.empty()) return;
  const Intrinsics& k = moment.view.camera.intrinsics;
  trace_solids(moment.solids, moment.view, [&](int x, int y, const SolidSeen& seen) {
    const std::size_t at = std::size_t(y) * truth.width + x;
    if (!(seen.depth_mm < truth.depth_mm[at])) return;
    truth.depth_mm[at] = seen.depth_mm;
    truth.label[at] = static_cast<std::uint8_t>(
        std::min<std::size_t>(255, kFirstToolLabel + moment.solids[seen.solid].instrument));
    truth.solid[at] = static_cast<std::uint16_t>(seen.solid + 1);
    if (!layers.normals) return;
    truth.point[at] = (seen.depth_mm * unproject(k, {x + 0.5, y + 0.5})).cast<float>();
    truth.normal[at] = seen.normal;
  });
}

// Works out what the layers need of a picture that was drawn with DrawOptions::keep_bound at a
// moment. The picture's bound pixels are taken out of it, and it will be drawn anew. Depth is that
// of the skin's sample at the pixel's centre; pixels that were filled are bound as their
// neighbours. The same for any number of threads.
void take_pixels(const Moment& moment, const LayerSet& layers, Frame& picture, PixelTruth& truth) {
  truth.width = picture.color.width, truth.height = picture.color.height;
  truth.bound.swap(picture.bound);
  truth.organ.swap(picture.organ);
  if (truth.organ.size() != truth.bound.size()) truth.organ.clear();
  follow_fills(picture, truth);
  picture.serial = 0;
  const std::size_t pixels = truth.pixels();
  truth.depth_mm.resize(pixels);
  truth.label.resize(pixels);
  truth.point.resize(layers.normals ? pixels : 0);
  truth.normal.resize(layers.normals ? pixels : 0);
  put_skin(moment, picture, truth);
  trim_outline(moment, truth);
  put_tools(moment, layers, truth);
  if (layers.normals) put_skin_normals(truth);
}

}  // namespace

void TruthTracker::advance(const Player& player, const View& view, const std::vector<Solid>& tools,
                           Frame& picture) {
  for (std::size_t organ = 0; organ < player.organ_count(); ++organ) {
    if (player.is_cut(organ))
      throw UsageError("the truth of a picture is told of organs as they were baked, and '" +
                       player.bundle(organ).manifest.name +
                       "' has been cut; leave out the layers, or the blade");
  }
  std::vector<const Warper*> organs;
  for (std::size_t o = 0; o < player.organ_count(); ++o) organs.push_back(&player.drawn(o));
  advance(organs, view, tools, picture);
}

void TruthTracker::advance(std::span<const Warper* const> organs, const View& view,
                           const std::vector<Solid>& tools, Frame& picture) {
  if (picture.bound.empty())
    throw UsageError("the truth of a picture needs it drawn with its bound pixels kept");
  ++pictures_;
  moments_[pictures_ % 2].take(organs, view, tools, layers_.flow || layers_.normals,
                               picture.bound_as_drawn);
  take_pixels(moments_[pictures_ % 2], layers_, picture, truths_[pictures_ % 2]);
}

}  // namespace organbake
