// SPDX-License-Identifier: Apache-2.0
// An organ for pictures whose pixels are larger than its texels. In: the organ and its cameras'
// samples. Out: the same with maps of half, a quarter or an eighth as many texels a side, each of
// which tells the mean of those it stands for, over the skin's faces or over the proxy's own, which
// are fewer and larger: a pyramid of images (Williams 1983), of posed faces as well as of texels.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "organbake/warp/draw_options.h"
#include "organbake/warp/warper.h"
#include "picture/spans.h"
#include "samples/samples.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A place on a surface's face.
struct FacePlace {
  std::uint32_t face;
  Vector2d at;  // b1, b2
};

// The skin's face at a place of the proxy's face, which is cut into steps² (smooth_skin_faces()).
FacePlace skin_place(std::uint32_t proxy_face, const Vector2d& at, std::uint32_t steps) {
  const auto cell = [](double along, std::uint32_t last) {
    return std::min(static_cast<std::uint32_t>(std::max(along, 0.0)), last);
  };
  const double u = at.x() * steps, v = at.y() * steps;
  const std::uint32_t i = cell(u, steps - 1), j = cell(v, steps - 1 - i);
  const double along = u - i, down = v - j;
  // The faces of the rows before, each two shorter than the last.
  const std::uint32_t face = proxy_face * steps * steps + i * (2 * steps - i) + 2 * j;
  if (along + down > 1 && i + j + 2 <= steps) return {face + 1, {along + down - 1, 1 - along}};
  return {face, {along, down}};
}

// The other way round.
FacePlace proxy_place(std::uint32_t skin_face, const Vector2d& at, std::uint32_t steps) {
  std::uint32_t left = skin_face % (steps * steps), i = 0;
  for (std::uint32_t row = 2 * steps - 1; left >= row; row -= 2, ++i) left -= row;
  const Vector2d cell(i, left / 2);
  const Vector2d within =
      left % 2 == 0 ? at : Vector2d(1 - at.y(), at.x() + at.y());  // the quad's other triangle
  return {skin_face / (steps * steps), (cell + within) / steps};
}

// Binds a point to a face by Newton's method, from a place near by. The shell map is all but linear
// over a face: each step leaves a hundredth of what was wrong.
ShellBinding bound_near(const ShellMatrix& shell, const Vector3d& point_mm, const FacePlace& from,
                        int steps = 3) {
  Vector3d at(from.at.x(), from.at.y(), 0);
  for (int step = 0; step < steps; ++step) {
    const Vector3d more = shell_jacobian(shell, at.x(), at.y(), at.z()).inverse() *
                          (point_mm - shell_point(shell, at.x(), at.y(), at.z()));
    if (!more.allFinite()) break;  // a collapsed prism
    at += more;
  }
  return {from.face, at.x(), at.y(), at.z()};
}

// Some of a skin's nodes, as one skin.
SmoothSkin nodes_of(const SmoothSkin& skin, const std::vector<std::uint32_t>& nodes) {
  SmoothSkin some;
  some.steps = 1;
  some.first = {0};
  for (const std::uint32_t node : nodes) {
    for (std::uint32_t k = skin.first[node]; k < skin.first[node + 1]; ++k) {
      some.carrier.push_back(skin.carrier[k]);
      some.weight.push_back(skin.weight[k]);
    }
    some.first.push_back(static_cast<std::uint32_t>(some.carrier.size()));
  }
  return some;
}

// The maps that a camera's samples were bound from, but for what they don't keep: what nothing is
// drawn from.
CameraMaps maps_of(const SampleSet& samples, const PosedCamera& camera,
                   const std::vector<ShellMatrix>& rest) {
  const Intrinsics& lens = camera.intrinsics;
  CameraMaps maps = background_maps(lens.width, lens.height);
  const auto put = [&](std::uint32_t face, const ShellMatrix& shell, std::size_t slot) {
    const std::array<float, 3> b = samples.bound(slot);
    const Vector3d point = shell_point(shell, b[0], b[1], b[2]);
    const Vector2d at = project(lens, point);
    const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
    if (x < 0 || y < 0 || x >= lens.width || y >= lens.height) return;  // by its rounding
    const std::size_t texel = std::size_t(y) * lens.width + x;
    const auto own = [&](int k) {
      return static_cast<float>(own_byte(samples.colors[slot], k)) / 255;
    };
    maps.depth_mm[texel] = static_cast<float>(point.z());
    maps.color[texel] = {own(0) * own(0), own(1) * own(1), own(2) * own(2)};
    maps.face[texel] = face;
    maps.confidence[texel] = own(3);
  };
  for (std::size_t c = 0; c < samples.chunks.size(); ++c) {
    const std::uint32_t face = samples.chunks[c].patch.face;
    const ShellMatrix shell = in_frame(rest[face], camera.camera_from_world);
    for (std::size_t i = 0; i < samples.chunks[c].count; ++i) put(face, shell, c * kChunk + i);
  }
  return maps;
}

// The texels that one stands for, where they show one surface.
class TexelBlock {
 public:
  TexelBlock(const CameraMaps& maps, int x0, int y0, int shrink, float steepest) {
    for (int y = y0; y < std::min(y0 + shrink, maps.height); ++y)
      for (int x = x0; x < std::min(x0 + shrink, maps.width); ++x)
        if (const std::size_t texel = std::size_t(y) * maps.width + x; maps.face[texel] != kNoFace)
          texels_[count_++] = static_cast<std::uint32_t>(texel);
    if (count_ == 0) return;
    const auto end = texels_.begin() + count_;
    const auto depth = [&](std::uint32_t texel) { return maps.depth_mm[texel]; };
    std::sort(texels_.begin(), end,
              [&](std::uint32_t a, std::uint32_t b) { return depth(a) < depth(b); });
    const float middle = depth(texels_[count_ / 2]);
    const float reach = steepest * static_cast<float>(shrink) * middle;
    count_ =
        std::remove_if(texels_.begin(), end,
                       [&](std::uint32_t t) { return !(std::abs(depth(t) - middle) <= reach); }) -
        texels_.begin();
  }
  // In use, by depth.
  std::span<const std::uint32_t> texels() const {
    return {texels_.data(), static_cast<std::size_t>(count_)};
  }

 private:
  static constexpr int kMostSide = 1 << CoarserOrgans::kHalvings;
  std::array<std::uint32_t, kMostSide * kMostSide> texels_;
  std::ptrdiff_t count_ = 0;
};

// One texel for shrink² of them, where at least half of those show one surface: an outline then
// lies where it lay, on average. Heights are those over `to`, the faces that are drawn.
CameraMaps shrunk(const CameraMaps& maps, const PosedCamera& small, int shrink, std::uint32_t steps,
                  const std::vector<ShellMatrix>& to) {
  constexpr float kSteepest = 6;  // texels of depth to one across: beyond, it is another surface
  const float steepest =
      kSteepest / static_cast<float>(shrink * std::sqrt(small.intrinsics.fx * small.intrinsics.fy));
  CameraMaps out = background_maps(small.intrinsics.width, small.intrinsics.height);
  const auto put = [&](int x, int y) {
    const TexelBlock block(maps, shrink * x, shrink * y, shrink, steepest);
    const std::span<const std::uint32_t> texels = block.texels();
    const std::size_t count = texels.size(), at = std::size_t(y) * out.width + x;
    if (2 * count < static_cast<std::size_t>(shrink * shrink)) return;
    double nearness = 0;  // planar over a plane, as depth is not
    float sure = 0;
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    for (const std::uint32_t texel : texels) {
      nearness += 1 / double(maps.depth_mm[texel]);
      sure += maps.confidence[texel];
      color += maps.confidence[texel] * maps.color[texel];
    }
    const std::size_t middle = texels[count / 2];
    const double depth = double(count) / nearness;
    const Vector3d point = depth * unproject(small.intrinsics, {x + 0.5, y + 0.5});
    const FacePlace face = proxy_place(maps.face[middle], {1.0 / 3, 1.0 / 3}, steps);
    out.depth_mm[at] = static_cast<float>(depth);
    out.color[at] = color / std::max(sure, kLeastConfidence);
    out.face[at] = face.face;
    out.height_mm[at] = static_cast<float>(bound_near(to[face.face], point, face).height_mm);
    out.confidence[at] = sure / static_cast<float>(count);
  };
  parallel_each(0, out.height, 8, [&](int y) {
    for (int x = 0; x < out.width; ++x) put(x, y);
  });
  return out;
}

// The base layer over the faces that are drawn, its nodes `shrink` times as far apart. A camera
// sees one where it sees all about it.
BaseLayer shrunk(const BaseLayer& layer, const std::vector<ShellMatrix>& skin_rest,
                 std::uint32_t steps, int shrink, const std::vector<ShellMatrix>& to) {
  if (layer.face_count == 0) return {};
  BaseLayer out;
  out.face_count = static_cast<std::uint32_t>(to.size());
  const std::uint32_t fine = steps * layer.steps;
  out.steps = (fine + static_cast<std::uint32_t>(shrink) - 1) / static_cast<std::uint32_t>(shrink);
  const std::size_t nodes = std::size_t(out.face_count) * out.nodes_per_face();
  out.height_mm.resize(nodes), out.color.resize(nodes), out.seen_by.assign(nodes, ~0u);
  const auto seen_about = [&](std::uint32_t face, const Vector2d& at) {
    const double half = 0.5 / out.steps;
    std::uint32_t seen = ~0u;
    for (const Vector2d& off :
         {Vector2d(0, 0), Vector2d(half, 0), Vector2d(-half, 0), Vector2d(0, half),
          Vector2d(0, -half), Vector2d(half, -half), Vector2d(-half, half)}) {
      const FacePlace near = skin_place(face, (at + off).cwiseMax(0).cwiseMin(1), steps);
      for (const std::uint32_t node : lattice_mix(layer.steps, near.at).nodes)
        seen &= layer.seen_by[std::size_t(near.face) * layer.nodes_per_face() + node];
    }
    return seen;
  };
  parallel_for(std::uint32_t{0}, out.face_count, [&](std::uint32_t face) {
    each_node(out.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const std::size_t to_node = std::size_t(face) * out.nodes_per_face() + node;
      const Vector2d at(double(i) / out.steps, double(j) / out.steps);
      const FacePlace on = skin_place(face, at, steps);
      const LatticeMix mix = lattice_mix(layer.steps, on.at);
      double height = 0;
      Eigen::Vector3f color = Eigen::Vector3f::Zero();
      for (int k = 0; k < 3; ++k) {
        const std::size_t from = std::size_t(on.face) * layer.nodes_per_face() + mix.nodes[k];
        height += double(mix.weights[k]) * layer.height_mm[from];
        color += mix.weights[k] * layer.color[from];
      }
      const Vector3d point = shell_point(skin_rest[on.face], on.at.x(), on.at.y(), height);
      out.height_mm[to_node] =
          static_cast<float>(bound_near(to[face], point, {face, at}).height_mm);
      out.color[to_node] = color;
      out.seen_by[to_node] = seen_about(face, at);
    });
  });
  return out;
}

// The size of a camera's pixel on the nearest of some points; 0 or less where one is not before it.
double pixel_mm(const std::vector<Eigen::Vector3d>& points, const PosedCamera& camera) {
  const auto& [rotation, translation] = camera.camera_from_world;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point : points)
    nearest = std::min(nearest, rotation.row(2).dot(point) + translation.z());
  return nearest / std::max(camera.intrinsics.fx, camera.intrinsics.fy);
}

}  // namespace

ShellMatrix in_frame(const ShellMatrix& matrix, const RigidTransform& frame_from_world) {
  ShellMatrix there = frame_from_world.rotation * matrix;
  there.col(0) += frame_from_world.translation;
  return there;
}

CoarserOrgan::CoarserOrgan(const Bundle& whole, std::shared_ptr<SampleStore> samples, int shrink,
                           CoarseFaces over)
    : cut_into_(whole.skin && over == CoarseFaces::of_proxy ? whole.skin->steps : 1),
      whole_rest_(shell_matrices(whole.shell().at_rest())),
      whole_samples_(std::move(samples)),
      samples_(whole.cameras.cameras.size(), [this, shrink,
                                              cameras = whole.cameras.cameras](std::size_t c) {
        const PosedCamera& small = bundle_.cameras.cameras[c];
        std::vector<ShellMatrix> rest = rest_;
        for (ShellMatrix& face : rest) face = in_frame(face, small.camera_from_world);
        const CameraMaps maps = maps_of(whole_samples_->made(c), cameras[c], whole_rest_);
        return build_sample_set(shrunk(maps, small, shrink, cut_into_, rest), small, rest_);
      }) {
  bundle_.proxy = whole.proxy;
  bundle_.skin = whole.skin;
  if (cut_into_ > 1) {
    std::vector<std::uint32_t> corners(whole.proxy.vertices.size());
    std::iota(corners.begin(), corners.end(), 0u);  // they are its first nodes
    bundle_.skin = nodes_of(*whole.skin, corners);
  }
  bundle_.lighting = whole.lighting;
  bundle_.cameras = whole.cameras;
  for (PosedCamera& camera : bundle_.cameras.cameras) {
    Intrinsics& k = camera.intrinsics;
    k.width = (k.width + shrink - 1) / shrink, k.height = (k.height + shrink - 1) / shrink;
    k.fx /= shrink, k.fy /= shrink, k.cx /= shrink, k.cy /= shrink;
  }
  rest_ = shell_matrices(bundle_.shell().at_rest());
  bundle_.base = shrunk(whole.base, whole_rest_, cut_into_, shrink, rest_);
  if (cut_into_ == 1) return;
  const TriangleMesh at_rest = whole.shell().at_rest();
  const Lattice lattice(bundle_.proxy, cut_into_);
  const std::uint32_t third = std::max(1u, cut_into_ / 3);
  const Vector2d middle = Vector2d::Constant(double(third) / cut_into_);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t f = 0; f < bundle_.proxy.faces.size(); ++f) {
    nodes.push_back(lattice.node(f, third, third));
    bound_middles_.push_back(bound_near(rest_[f], at_rest.vertices[nodes.back()], {f, middle}));
  }
  middles_ = nodes_of(*whole.skin, nodes);
}

BoundPixel on_drawn_skin(const BoundPixel& own, std::uint32_t cut_into) {
  const FacePlace place = proxy_place(own.face, {own.b1, own.b2}, cut_into);
  BoundPixel on = own;
  on.face = place.face;
  on.b1 = static_cast<float>(place.at.x()), on.b2 = static_cast<float>(place.at.y());
  return on;
}

void CoarserOrgan::bind_to_whole(BoundPixel& pixel) const {
  const FacePlace near = skin_place(pixel.face, {pixel.b1, pixel.b2}, cut_into_);
  const Vector3d point = shell_point(rest_[pixel.face], pixel.b1, pixel.b2, pixel.height_mm);
  const ShellBinding bound = bound_near(whole_rest_[near.face], point, near, 1);
  pixel.face = near.face;
  pixel.b1 = static_cast<float>(bound.b1), pixel.b2 = static_cast<float>(bound.b2);
  pixel.height_mm = static_cast<float>(bound.height_mm);
}

bool CoarserOrgan::follows(const std::vector<Vector3d>& proxy,
                           const std::vector<ShellMatrix>& shells,
                           const PosedCamera& camera) const {
  constexpr double kStray_px = 0.5;
  std::vector<Vector3d> middles;
  carry(middles_, proxy, middles);
  const double most_mm = kStray_px * pixel_mm(proxy, camera);
  for (std::size_t f = 0; f < middles.size(); ++f) {
    const auto& [face, b1, b2, height_mm] = bound_middles_[f];
    if (!((shell_point(shells[face], b1, b2, height_mm) - middles[f]).norm() <= most_mm))
      return false;
  }
  return true;
}

CoarserOrgans::CoarserOrgans(const std::vector<PosedCamera>& cameras,
                             const std::vector<Vector3d>& proxy_at_rest) {
  for (const PosedCamera& camera : cameras)
    texel_mm_ += pixel_mm(proxy_at_rest, camera) / double(cameras.size());
}

int CoarserOrgans::halvings(const std::vector<Vector3d>& proxy, const PosedCamera& camera) const {
  if (!(texel_mm_ > 0)) return 0;
  const double texels = pixel_mm(proxy, camera) / texel_mm_;
  int halvings = 0;
  while (halvings < kHalvings && texels >= 2 << halvings) ++halvings;
  return halvings;
}

std::shared_ptr<CoarserOrgan> CoarserOrgans::of(int halvings, CoarseFaces over,
                                                const std::function<Bundle()>& whole,
                                                const std::shared_ptr<SampleStore>& samples) {
  const std::lock_guard lock(making_);
  std::shared_ptr<CoarserOrgan>& made = made_[static_cast<int>(over)][halvings - 1];
  // A thread that waits inside must not pick up another picture, which could wait for this one.
  if (!made)
    isolated([&] { made = std::make_shared<CoarserOrgan>(whole(), samples, 1 << halvings, over); });
  return made;
}

}  // namespace organbake
