// SPDX-License-Identifier: Apache-2.0
#include "warp/warper.h"

#include <algorithm>
#include <atomic>

#include "core/error.h"
#include "core/parallel.h"
#include "warp/drawing/base_drawing.h"
#include "warp/drawing/resolve.h"
#include "warp/drawing/tile_drawing.h"
#include "warp/finishing/cover_mask.h"
#include "warp/finishing/post_process.h"
#include "warp/light/lattice_normals.h"
#include "warp/light/light_meter.h"
#include "warp/light/relit_skin.h"
#include "warp/picture/phase_clock.h"
#include "warp/picture/tile_grid.h"
#include "warp/placing/active_cameras.h"
#include "warp/placing/dirty_cells.h"
#include "warp/placing/posed_shell.h"
#include "warp/samples/bundle_fit.h"
#include "warp/samples/face_split.h"
#include "warp/samples/sample_store.h"

namespace organbake {
namespace {

std::vector<ShellMatrix> in_frame(std::vector<ShellMatrix> matrices,
                                  const RigidTransform& frame_from_world) {
  for (ShellMatrix& matrix : matrices) {
    matrix = frame_from_world.rotation * matrix;
    matrix.col(0) += frame_from_world.translation;
  }
  return matrices;
}

}  // namespace

struct Warper::Impl {
  PosedShell shell;
  Bounds organ;  // at rest
  ViewManifold manifold;
  std::vector<ShellMatrix> rest;
  BaseDrawing base;
  // The last drawing, to recognise when nothing changed.
  View last_view;
  DrawOptions last_options;
  DrawReport last_report;
  std::uint64_t serial = 0;
  // Kept between frames for their memory.
  ActiveCameras active;
  float texel_mm = 1;  // of the active cameras
  std::vector<FaceFrame> faces, last_faces;
  std::vector<std::uint8_t> moved;  // per face, since the last frame; empty: all is new
  DirtyCells dirty_cells;
  PostProcess post_process;
  VisibilitySummary visibility;             // once the base layer is placed, of that, too
  std::vector<std::uint8_t> may_have_gaps;  // per face: its samples may leave pixels open
  TileLists base_tiles;
  SkinDepth depth;
  TileDrawing tiles;
  std::optional<RelitSkin> relit;   // when the bundle knows its light
  std::optional<ScopeLight> scope;  // that the bundle is meant to be seen in
  std::shared_ptr<SampleStore> store;
  bool cut = false;  // tissue beside cuts opens gaps between samples anywhere

  // whole: of the organ before blades cut it into `parts`, where they have.
  Impl(const Bundle& bundle, std::shared_ptr<SampleStore> samples, const Impl* whole = nullptr,
       const CutOrgan::FaceParts& parts = {});
  bool continues(const View& view, const DrawOptions& options, const Frame& frame) const;
  void choose_cameras(const View& view, DrawReport& report);
  void place_faces(const View& view, bool continued);
  void place_samples(const View& view, const TileGrid& grid, DrawReport& report);
  void place_base(const View& view, const TileGrid& grid, const DrawReport& report);
  float reach_mm(const View& view) const;
  void light_faces(const View& view, const DrawOptions& options);
  void draw_tiles(const View& view, const TileGrid& grid, const DrawOptions& options,
                  const Background& background, Frame& frame, DrawReport& report);
};

namespace {

// What turns a camera's maps into its samples, without holding on to the bundle.
SampleStore::Make binding(const Bundle& bundle, Warper::ReadMaps read) {
  return [read = std::move(read), cameras = bundle.cameras.cameras,
          rest = shell_matrices(bundle.shell().at_rest())](std::size_t c) {
    const CameraMaps maps = read(c);
    check_maps_fit(maps, c, cameras[c].intrinsics, rest.size());
    return build_sample_set(maps, cameras[c], in_frame(rest, cameras[c].camera_from_world));
  };
}

}  // namespace

Warper::Impl::Impl(const Bundle& bundle, std::shared_ptr<SampleStore> samples, const Impl* whole,
                   const CutOrgan::FaceParts& parts)
    : shell(bundle.shell()),
      manifold(bundle.cameras.manifold),
      rest(shell.matrices()),
      base(bundle.base, rest),
      store(std::move(samples)),
      cut(whole != nullptr) {
  organ = bounds(shell.at_rest());
  if (bundle.lighting && bundle.base.face_count > 0) {
    std::vector<Eigen::Vector3d> normals = lattice_normals(bundle.base, shell.at_rest());
    if (whole) keep_uncut_normals(whole->relit->rest_normals(), parts, bundle.base, normals);
    relit.emplace(bundle.base, shell.shell(), *bundle.lighting, normals);
    scope = bundle.lighting->scope;
  }
}

void Warper::Impl::choose_cameras(const View& view, DrawReport& report) {
  report.weights = drawn_shares(manifold, view);
  const std::vector<std::size_t> cameras = used_cameras(report.weights);
  store->require(cameras);
  active.choose(*store, report.weights);
  report.texel_mm = texel_mm = active.texel_mm();
}

// Whether the frame is the last one drawn, of the same view, with at most other tools in it.
bool Warper::Impl::continues(const View& view, const DrawOptions& options,
                             const Frame& frame) const {
  if (serial == 0 || frame.serial != serial || !(view == last_view)) return false;
  DrawOptions same_tools = options;
  same_tools.solids = last_options.solids;
  return same_tools == last_options &&
         frame.depth_mm.empty() == !(options.keep_depth || !options.solids.empty()) &&
         frame.shown.empty() == !options.keep_shown && frame.bound.empty() == !options.keep_bound;
}

// Farther away lies no skin, poked skin within reason included.
float Warper::Impl::reach_mm(const View& view) const {
  const double away = (view.camera.center_world_mm() - organ.center()).norm();
  return static_cast<float>(away + organ.diagonal());
}

void Warper::Impl::place_faces(const View& view, bool continued) {
  last_faces.swap(faces);
  face_frames(shell, view, faces);
  moved.clear();
  dirty_cells.reset(view.camera.intrinsics.width, view.camera.intrinsics.height, !continued);
  if (!continued) return;
  moved.resize(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) moved[f] = !(faces[f] == last_faces[f]);
}

void Warper::Impl::place_samples(const View& view, const TileGrid& grid, DrawReport& report) {
  active.place(faces, moved, view, grid, dirty_cells);
  active.summarise(faces.size(), report, visibility);
}

void Warper::Impl::place_base(const View& view, const TileGrid& grid, const DrawReport& report) {
  may_have_gaps = visibility.stretched;
  for (std::size_t f = 0; f < faces.size(); ++f) may_have_gaps[f] |= faces[f].two_sided || cut;
  const auto mark_moved = [&] {
    for (std::uint32_t b = 0; !moved.empty() && b < base.chosen_count(); ++b) {
      if (moved[base.face(b)]) dirty_cells.mark(base.box(b));
    }
  };
  mark_moved();
  base.choose(faces, may_have_gaps, report.weights, view);
  mark_moved();
  const auto box_of = [&](std::uint32_t block) { return base.box(block); };
  for (std::uint32_t b = 0; b < base.chosen_count(); ++b) {
    visibility.box = united(visibility.box, box_of(b));
    visibility.shown[base.face(b)] = 1;
  }
  base_tiles.build(grid, base.chosen_count(), box_of);
}

void Warper::Impl::light_faces(const View& view, const DrawOptions& options) {
  if (options.light == DrawnLight::world) relit->light_faces(view, visibility.shown);
  if (options.light != DrawnLight::scope) return;
  double reference_mm = options.scope_reference_mm;
  if (!(reference_mm > 0)) {
    LightMeter meter(scope.value_or(ScopeLight()), view);
    meter.add(shell.shell().proxy());
    reference_mm = meter.reference_mm();
  }
  relit->light_faces_from_scope(view, reference_mm, visibility.shown);
}

// Those tiles, or parts of them, in which something moved.
void Warper::Impl::draw_tiles(const View& view, const TileGrid& grid, const DrawOptions& options,
                              const Background& background, Frame& frame, DrawReport& report) {
  tiles.begin({.view = view,
               .cameras = active.all(),
               .texel_mm = texel_mm,
               .base = base,
               .base_tiles = options.base_layer ? &base_tiles : nullptr,
               .faces = faces,
               .relit = options.light != DrawnLight::baked ? &*relit : nullptr,
               .rest = options.keep_shown ? &rest : nullptr,
               .keep_bound = options.keep_bound,
               .background = background,
               .measure = options.measure});
  std::atomic<int> drawn = 0;
  parallel_for(0, grid.count(), [&](int t) {
    const PixelBox part = dirty_cells.within(grid.box(t));
    if (part.empty()) return;
    tiles.draw(t, grid.box(t), part, depth, frame);
    ++drawn;
  });
  tiles.count(report);
  report.tiles_drawn = drawn;
  report.tiles_kept = grid.count() - drawn;
  report.sample_pixels = count_cover(frame, visibility.box, Cover::samples);
  report.base_pixels = count_cover(frame, visibility.box, Cover::base);
}

Warper::Warper(const Bundle& bundle)
    : Warper(bundle, [&bundle](std::size_t camera) { return bundle.maps.at(camera); }) {
  bind_all();  // while the bundle is there
}
Warper::Warper(const Bundle& bundle, ReadMaps read) {
  check_fit(bundle);
  impl_ = std::make_unique<Impl>(bundle,
                                 std::make_shared<SampleStore>(bundle.cameras.cameras.size(),
                                                               binding(bundle, std::move(read))));
}
Warper::Warper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Warper::~Warper() = default;
Warper::Warper(Warper&&) noexcept = default;
Warper& Warper::operator=(Warper&&) noexcept = default;

Warper Warper::cut(const Bundle& now, const CutOrgan::FaceParts& parts) const {
  const auto split = [uncut = impl_->store, parts](std::size_t camera) {
    return split_samples(uncut->made(camera), parts);
  };
  auto store = std::make_shared<SampleStore>(now.cameras.cameras.size(), split);
  return Warper(std::make_unique<Impl>(now, std::move(store), impl_.get(), parts));
}

DrawReport Warper::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                        const DrawOptions& options, Frame& frame) {
  Impl& s = *impl_;
  view.check();
  check_positions(positions, s.shell.shell().proxy());
  const bool relight = options.light != DrawnLight::baked;
  if (relight && !s.relit)
    throw UsageError(
        "the bundle does not say in what light its colours were taken, or has no base layer: its "
        "skin cannot be lit anew; bake it with a lighting.json, or draw it with the baked light");
  if (s.serial != 0 && frame.serial == s.serial && view == s.last_view &&
      positions == s.shell.proxy_positions() && options == s.last_options) {
    DrawReport report = s.last_report;
    report.unchanged = true;
    report.times = {};
    return report;
  }
  DrawReport report;
  const bool continued = s.continues(view, options, frame);
  frame.serial = 0;
  const int width = view.camera.intrinsics.width, height = view.camera.intrinsics.height;
  const std::size_t pixels = std::size_t(width) * height;
  frame.color.width = width;
  frame.color.height = height;
  frame.color.pixels.resize(3 * pixels);
  frame.cover.resize(pixels);
  frame.depth_mm.resize(options.keep_depth || !options.solids.empty() ? pixels : 0);
  frame.shown.resize(options.keep_shown ? pixels : 0);
  frame.bound.resize(options.keep_bound ? pixels : 0);
  frame.organ.clear();
  s.depth.resize(width, height, s.reach_mm(view));

  const TileGrid grid(width, height);
  const Background background(options.background);
  PhaseClock clock(options.measure);
  s.shell.pose(positions);
  s.choose_cameras(view, report);
  if (continued) s.post_process.undo(background, frame);
  s.place_faces(view, continued);
  if (relight) s.relit->turn(s.shell.matrices(), s.moved);
  s.place_samples(view, grid, report);
  clock.lap(report.times.transform);
  s.place_base(view, grid, report);
  s.light_faces(view, options);
  clock.lap(report.times.base);
  s.draw_tiles(view, grid, options, background, frame, report);
  s.post_process.apply(view, options, s.visibility.box, s.depth, kStepTexels * s.texel_mm, frame,
                       report);

  s.last_view = view;
  s.last_options = options;
  s.last_report = report;
  // Serials differ between warpers, too: a frame may pass from one to another.
  static std::atomic<std::uint64_t> next_serial{0};
  frame.serial = s.serial = ++next_serial;
  return report;
}

bool Warper::can_relight() const { return impl_->relit.has_value(); }

DrawnLight Warper::usual_light() const {
  if (!impl_->relit) return DrawnLight::baked;
  return impl_->scope ? DrawnLight::scope : DrawnLight::world;
}
const std::vector<ShellMatrix>& Warper::shell_matrices() const { return impl_->shell.matrices(); }
void Warper::bind_all() { impl_->store->require_all(); }
void Warper::bind_ahead() { impl_->store->make_ahead(); }
bool Warper::bind_next() { return impl_->store->make_next(); }

}  // namespace organbake
