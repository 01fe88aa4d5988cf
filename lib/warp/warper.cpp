// SPDX-License-Identifier: Apache-2.0
#include "warp/warper.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>

#include "core/error.h"
#include "warp/base_drawing.h"
#include "warp/hole_fill.h"
#include "warp/resolve.h"
#include "warp/slit_fill.h"
#include "warp/splat.h"
#include "warp/tile_grid.h"

namespace organbake {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void check_bundle(const Bundle& bundle) {
  const std::size_t cameras = bundle.cameras.cameras.size(), faces = bundle.proxy.faces.size();
  if (bundle.maps.size() != cameras || bundle.cameras.manifold.directions.size() != cameras) {
    throw BadDataError("bundle: cameras, maps and viewing manifold differ in number");
  }
  for (std::size_t c = 0; c < cameras; ++c) {
    const CameraMaps& m = bundle.maps[c];
    const Intrinsics& k = bundle.cameras.cameras[c].intrinsics;
    const std::size_t texels = std::size_t(k.width) * k.height;
    if (m.width != k.width || m.height != k.height || m.depth_mm.size() != texels ||
        m.color.size() != texels || m.height_mm.size() != texels || m.face.size() != texels ||
        m.confidence.size() != texels) {
      throw BadDataError("bundle: the maps of camera " + std::to_string(c) +
                         " do not fit its size");
    }
    for (const std::uint32_t face : m.face) {
      if (face != kNoFace && face >= faces) {
        throw BadDataError("bundle: camera " + std::to_string(c) + " names face " +
                           std::to_string(face) + ", the proxy has " + std::to_string(faces));
      }
    }
  }
  const BaseLayer& b = bundle.base;
  const std::size_t nodes = std::size_t(b.face_count) * b.nodes_per_face();
  if (b.face_count != 0 && (b.face_count != faces || b.steps < 1 || b.height_mm.size() != nodes ||
                            b.color.size() != nodes || b.seen_by.size() != nodes)) {
    throw BadDataError("bundle: the base layer does not fit the proxy");
  }
}

std::vector<ShellMatrix> rest_in_camera(const TriangleMesh& proxy,
                                        const std::vector<Eigen::Vector3d>& normals,
                                        const RigidTransform& camera_from_world) {
  std::vector<ShellMatrix> matrices(proxy.faces.size());
  for (std::uint32_t f = 0; f < matrices.size(); ++f) {
    matrices[f] = camera_from_world.rotation * shell_matrix(proxy, normals, f);
    matrices[f].col(0) += camera_from_world.translation;
  }
  return matrices;
}

// What one active camera does in one frame.
struct ActiveCamera {
  const SampleSet* set = nullptr;
  float weight = 0;
  std::vector<ChunkFrame> chunks;
  TileLists tiles;
};

struct TileScratch {
  std::array<TileKeys, 3> keys;
  RowSpans spans;
  BaseTile base;
  DrawTimes times;
  ResolveCounts counts;
};

}  // namespace

ViewWeights trimmed(ViewWeights w) {
  double sum = 0;
  for (double& weight : w.weights) {
    weight = std::max(0.0, (weight - kLeastShare) / (1 - kLeastShare));
    sum += weight;
  }
  for (double& weight : w.weights) weight /= sum;  // the largest is at least a third: sum > 0
  return w;
}

struct Warper::Impl {
  TriangleMesh deformed;
  TriangleMesh at_rest;
  ViewManifold manifold;
  std::vector<SampleSet> sets;
  BaseDrawing base;
  bool has_base;
  float texel_mm;

  // The last drawing, to recognise when nothing changed.
  View last_view;
  DrawOptions last_options;
  DrawReport last_report;
  std::uint64_t serial = 0;

  // Kept between frames for their memory.
  std::array<ActiveCamera, 3> active;
  int active_count = 0;
  std::vector<FaceFrame> faces;
  std::vector<std::uint8_t> stretched;
  std::vector<BaseTriangle> base_triangles;
  TileLists base_tiles;
  PixelBox drawn_box;  // of everything but the background
  tbb::enumerable_thread_specific<TileScratch> scratch;

  explicit Impl(const Bundle& bundle);
  void choose_cameras(const View& view, DrawReport& report);
  void place_chunks(const View& view, const TileGrid& grid, DrawReport& report);
  void count_skips(DrawReport& report) const;
  void place_base(const View& view, const TileGrid& grid, const DrawOptions& options,
                  DrawReport& report);
  void draw_tile(int tile, const TileGrid& grid, const View& view, const DrawOptions& options,
                 const Background& background, Frame& frame);
};

Warper::Impl::Impl(const Bundle& bundle)
    : deformed(bundle.proxy),
      manifold(bundle.cameras.manifold),
      base(bundle.base),
      has_base(bundle.base.face_count > 0) {
  deformed.colors.clear();
  at_rest = deformed;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(bundle.proxy);
  sets.resize(bundle.maps.size());
  tbb::parallel_for(std::size_t{0}, sets.size(), [&](std::size_t c) {
    const PosedCamera& camera = bundle.cameras.cameras[c];
    sets[c] = build_sample_set(bundle.maps[c], camera,
                               rest_in_camera(bundle.proxy, normals, camera.camera_from_world));
  });
  double sum = 0, samples = 0;
  for (const SampleSet& set : sets) {
    sum += set.texel_mm * static_cast<double>(set.sample_count);
    samples += static_cast<double>(set.sample_count);
  }
  // An empty organ has no texels; any size will do.
  texel_mm = samples > 0 ? static_cast<float>(sum / samples) : 1;
}

void Warper::Impl::choose_cameras(const View& view, DrawReport& report) {
  Eigen::Vector3d towards_eye = view.camera.center_world_mm() - manifold.center_world_mm;
  if (!(towards_eye.norm() > 1e-9)) towards_eye = -view.camera.view_direction_world();
  report.weights = trimmed(view_weights(manifold, towards_eye));
  active_count = 0;
  for (int i = 0; i < 3; ++i) {
    if (report.weights.weights[i] <= 0) continue;
    active[active_count].set = &sets[report.weights.cameras[i]];
    active[active_count++].weight = static_cast<float>(report.weights.weights[i]);
  }
}

void Warper::Impl::place_chunks(const View& view, const TileGrid& grid, DrawReport& report) {
  faces = face_frames(deformed, at_rest, view);
  for (int a = 0; a < active_count; ++a) {
    ActiveCamera& camera = active[a];
    const std::vector<Chunk>& chunks = camera.set->chunks;
    camera.chunks.resize(chunks.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks.size(), 256),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t c = range.begin(); c < range.end(); ++c) {
                          const Patch& patch = chunks[c].patch;
                          camera.chunks[c] = chunk_frame(patch, faces[patch.face], view);
                        }
                      });
    camera.tiles.build(grid, static_cast<std::uint32_t>(chunks.size()),
                       [&](std::uint32_t c) { return camera.chunks[c].box; });
  }
  count_skips(report);
  stretched.assign(faces.size(), 0);
  drawn_box = {};
  for (int a = 0; a < active_count; ++a) {
    for (std::size_t c = 0; c < active[a].chunks.size(); ++c) {
      const ChunkFrame& chunk = active[a].chunks[c];
      if (chunk.fate != ChunkFate::drawn) continue;
      drawn_box = united(drawn_box, chunk.box);
      const int splat = std::max(chunk.columns, chunk.rows);
      report.largest_stretch_px = std::max<double>(report.largest_stretch_px, splat);
      if (splat == kMostSplat) stretched[active[a].set->chunks[c].patch.face] = 1;
    }
  }
}

void Warper::Impl::count_skips(DrawReport& report) const {
  for (int a = 0; a < active_count; ++a) {
    const std::vector<Chunk>& chunks = active[a].set->chunks;
    for (std::size_t c = 0; c < chunks.size();) {
      const std::uint32_t face = chunks[c].patch.face;
      std::array<std::size_t, 3> samples{};
      for (; c < chunks.size() && chunks[c].patch.face == face; ++c) {
        samples[static_cast<int>(active[a].chunks[c].fate)] += chunks[c].count;
      }
      report.samples_drawn += samples[0];
      report.samples_facing_away += samples[1];
      report.samples_outside_view += samples[2];
      if (samples[0] > 0) {
        ++report.faces_drawn;
      } else {
        ++(samples[2] > 0 ? report.faces_outside_view : report.faces_facing_away);
      }
    }
  }
}

void Warper::Impl::place_base(const View& view, const TileGrid& grid, const DrawOptions& options,
                              DrawReport& report) {
  base_triangles.clear();
  if (has_base && options.base_layer) {
    base_triangles = base.triangles(faces, stretched, report.weights, view);
  }
  report.base_triangles = base_triangles.size();
  for (const BaseTriangle& t : base_triangles) drawn_box = united(drawn_box, t.box);
  base_tiles.build(grid, static_cast<std::uint32_t>(base_triangles.size()),
                   [&](std::uint32_t t) { return base_triangles[t].box; });
}

void Warper::Impl::draw_tile(int tile, const TileGrid& grid, const View& view,
                             const DrawOptions& options, const Background& background,
                             Frame& frame) {
  const PixelBox box = grid.box(tile);
  TileScratch& own = scratch.local();
  bool anything = !base_tiles[tile].empty();
  for (int a = 0; a < active_count; ++a) anything |= !active[a].tiles[tile].empty();
  if (!anything) return background.fill(box, frame);

  auto start = options.measure ? Clock::now() : Clock::time_point{};
  const auto lap = [&](double& phase) {
    if (!options.measure) return;
    phase += since(start);
    start = Clock::now();
  };
  own.spans.clear(box);
  TileLayers layers;
  layers.tie_mm = kTieTexels * texel_mm;
  layers.same_surface_mm = 2 * texel_mm;
  for (int a = 0; a < active_count; ++a) {
    const auto chosen = active[a].tiles[tile];
    if (chosen.empty()) continue;
    TileKeys& keys = own.keys[a];
    keys.clear(box);
    for (const std::uint32_t c : chosen) {
      own.spans.add(active[a].chunks[c].box);
      splat_chunk(*active[a].set, c, active[a].chunks[c],
                  faces[active[a].set->chunks[c].patch.face], static_cast<float>(view.near_mm),
                  layers.tie_mm, keys);
    }
    layers.layers[layers.count++] = {active[a].set, &keys, active[a].weight};
  }
  lap(own.times.splat);
  if (!base_tiles[tile].empty()) {
    own.base.clear(box);
    draw_base(base_triangles, base_tiles[tile], own.base);
    for (const std::uint32_t t : base_tiles[tile]) own.spans.add(base_triangles[t].box);
    if (own.base.drawn) layers.base = &own.base;
  }
  lap(own.times.base);
  const ResolveCounts counts = resolve_tile(layers, own.spans, box, background, frame);
  own.counts.sample_pixels += counts.sample_pixels;
  own.counts.base_pixels += counts.base_pixels;
  lap(own.times.resolve);
}

Warper::Warper(const Bundle& bundle) {
  check_bundle(bundle);
  impl_ = std::make_unique<Impl>(bundle);
}
Warper::~Warper() = default;
Warper::Warper(Warper&&) noexcept = default;

DrawReport Warper::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                        const DrawOptions& options, Frame& frame) {
  Impl& s = *impl_;
  view.check();
  if (positions.size() != s.deformed.vertices.size()) {
    throw BadDataError("draw: " + std::to_string(positions.size()) + " positions for a proxy of " +
                       std::to_string(s.deformed.vertices.size()) + " vertices");
  }
  if (s.serial != 0 && frame.serial == s.serial && view == s.last_view &&
      positions == s.deformed.vertices && options == s.last_options) {
    DrawReport report = s.last_report;
    report.unchanged = true;
    report.times = {};
    return report;
  }
  for (const Eigen::Vector3d& p : positions) {
    if (!p.allFinite()) throw BadDataError("draw: a proxy vertex is not finite");
  }
  DrawReport report;
  frame.serial = 0;
  s.deformed.vertices = positions;
  const int width = view.camera.intrinsics.width, height = view.camera.intrinsics.height;
  const std::size_t pixels = std::size_t(width) * height;
  frame.color.width = width;
  frame.color.height = height;
  frame.color.pixels.resize(3 * pixels);
  frame.cover.resize(pixels);
  frame.depth_mm.resize(options.keep_depth || !options.solids.empty() ? pixels : 0);

  const TileGrid grid(width, height);
  auto start = options.measure ? Clock::now() : Clock::time_point{};
  const auto lap = [&](double& phase) {
    if (!options.measure) return;
    phase += since(start);
    start = Clock::now();
  };
  s.choose_cameras(view, report);
  s.place_chunks(view, grid, report);
  lap(report.times.transform);
  s.place_base(view, grid, options, report);
  lap(report.times.base);
  for (TileScratch& one : s.scratch) one.times = {}, one.counts = {};
  const Background background(options.background);
  tbb::parallel_for(0, grid.count(),
                    [&](int t) { s.draw_tile(t, grid, view, options, background, frame); });
  for (const TileScratch& one : s.scratch) {
    report.times.splat += one.times.splat;
    report.times.base += one.times.base;
    report.times.resolve += one.times.resolve;
    report.sample_pixels += one.counts.sample_pixels;
    report.base_pixels += one.counts.base_pixels;
  }
  if (options.measure) start = Clock::now();
  const std::size_t slits = fill_slits(s.drawn_box, options.fill_holes, frame);
  const HoleCounts holes = fill_holes(s.drawn_box, options.fill_holes, frame);
  report.holes_before = slits + holes.before;
  report.holes_after = holes.after;
  if (!options.solids.empty()) draw_solids(options.solids, view, frame);
  lap(report.times.fill);

  s.last_view = view;
  s.last_options = options;
  s.last_report = report;
  // Serials differ between warpers, too: a frame may pass from one to another.
  static std::atomic<std::uint64_t> next_serial{0};
  frame.serial = s.serial = ++next_serial;
  return report;
}

std::size_t Warper::sample_count() const {
  std::size_t count = 0;
  for (const SampleSet& set : impl_->sets) count += set.sample_count;
  return count;
}

std::size_t Warper::memory_bytes() const {
  std::size_t bytes = 0;
  for (const SampleSet& set : impl_->sets) {
    bytes += set.b1.size() * (3 * sizeof(float) + sizeof(PackedDetail)) +
             set.chunks.size() * sizeof(Chunk);
  }
  return bytes;
}

}  // namespace organbake
