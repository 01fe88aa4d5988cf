// SPDX-License-Identifier: Apache-2.0
// Draws one organ from any view by a three-dimensional image warp of its samples (the paper, 2.2).
// This file runs a frame's passes in order, and keeps between frames what the next one can go on
// with.
#include "organbake/warp/warper.h"

#include <atomic>
#include <utility>

#include "drawing/base_drawing.h"
#include "drawing/splat.h"
#include "drawing/tile_drawing.h"
#include "finishing/post_process.h"
#include "light/relit_skin.h"
#include "light/scope_shine.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/warp/organ_source.h"
#include "picture/spans.h"
#include "placing/placing.h"
#include "samples/samples.h"

namespace organbake {
namespace {

std::uint64_t next_id() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

void count_pixels(const Frame& frame, const PixelBox& box, DrawReport& report) {
  std::atomic<std::size_t> samples = 0, base = 0;
  constexpr int kGrain = 64;
  parallel_each(box.y0, box.y1, kGrain, [&](int y) {
    const Cover* const row = frame.cover.data() + std::size_t(y) * frame.color.width;
    unsigned of_samples = 0, of_base = 0;  // narrow: more of them to a vector
    for (int x = box.x0; x < box.x1; ++x)
      of_samples += row[x] == Cover::samples, of_base += row[x] == Cover::base;
    samples += of_samples, base += of_base;
  });
  report.sample_pixels = samples, report.base_pixels = base;
}

}  // namespace

struct Warper::Impl {
  const std::uint64_t id = next_id();
  // The organ.
  PosedShell shell;
  Bounds organ = bounds(shell.at_rest());
  std::shared_ptr<const std::vector<ShellMatrix>> rest;  // by face, world
  std::shared_ptr<SampleStore> store;
  std::optional<RelitSkin> relit;  // when the bundle knows its light
  std::optional<Lighting> lighting;
  const bool cut;  // by blades: tissue beside cuts opens gaps between samples anywhere
  // The proxy before that, by which light is metered: walls of a closed cut would count, too.
  const TriangleMesh metered;
  LastDrawing last;
  // What the passes of a frame make; the next frame goes on with it, or takes its memory.
  ActiveCameras active;
  PlacedFaces faces;
  BaseDrawing base;
  DirtyCells dirty_cells;
  SkinDepth depth;
  TileDrawing tiles;
  PostProcess post_process;
  // The organ of fewer texels, until a blade cuts it; and what draws it, by what it lies over and
  // by halvings of its maps.
  CameraSet cameras;
  std::shared_ptr<CoarserOrgans> coarser;
  std::array<std::array<std::unique_ptr<Impl>, CoarserOrgans::kHalvings>, 2> coarse;
  const CoarserOrgan* drawn_for = nullptr;  // whose faces are others than the organ's
  const Impl* last_drawn = nullptr;         // of them, where the last picture was of one

  // whole: of the organ before blades cut it into `parts`, where they have.
  Impl(const Bundle& bundle, std::shared_ptr<SampleStore> samples, const Impl* whole = nullptr,
       const CutOrgan::FaceParts& parts = {});
  DrawReport draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                  const DrawOptions& options, Frame& frame, bool continued);
  // This, or what draws the organ of fewer texels.
  Impl& for_view(const std::vector<Eigen::Vector3d>& positions, const View& view,
                 const std::vector<SkinFold>& folds);

 private:
  Impl& coarse_one(int halvings, CoarseFaces over);
  Bundle without_maps() const;
  void place_faces(const View& view, const DrawOptions& options, float texel_mm, bool continued);
  void draw_tiles(const View& view, const TileGrid& grid, const DrawOptions& options, Frame& frame,
                  DrawReport& report);
};

Warper::Impl::Impl(const Bundle& bundle, std::shared_ptr<SampleStore> samples, const Impl* whole,
                   const CutOrgan::FaceParts& parts)
    : shell(bundle.shell()),
      rest(std::make_shared<std::vector<ShellMatrix>>(shell.matrices())),
      store(std::move(samples)),
      lighting(bundle.lighting),
      cut(whole != nullptr),
      metered(whole ? whole->metered : bundle.proxy),
      base(bundle.base, *rest),
      post_process(bundle.lighting.value_or(Lighting())),
      cameras(bundle.cameras) {
  if (bundle.lighting && bundle.base.face_count > 0) {
    relit.emplace(
        bundle.base, shell.shell(), *bundle.lighting,
        whole ? cut_normals(whole->relit->rest_normals(), parts, shell.at_rest(), bundle.base.steps)
              : lattice_normals(bundle.base, shell.at_rest()));
  }
}

Warper::Impl& Warper::Impl::for_view(const std::vector<Eigen::Vector3d>& positions,
                                     const View& view, const std::vector<SkinFold>& folds) {
  const int halvings = coarser ? coarser->halvings(positions, view.camera) : 0;
  if (halvings == 0) return *this;
  Impl& over_proxy = coarse_one(halvings, CoarseFaces::of_proxy);
  over_proxy.shell.pose(positions, folds);
  if (over_proxy.drawn_for->follows(positions, over_proxy.shell.matrices(), view.camera))
    return over_proxy;
  Impl& over_skin = coarse_one(halvings, CoarseFaces::of_skin);
  over_skin.shell.pose(positions, folds);
  return over_skin;
}

Warper::Impl& Warper::Impl::coarse_one(int halvings, CoarseFaces over) {
  std::unique_ptr<Impl>& one = coarse[static_cast<int>(over)][halvings - 1];
  if (!one) {
    const auto of = coarser->of(
        halvings, over, [this] { return without_maps(); }, store);
    one = std::make_unique<Impl>(of->bundle(), std::shared_ptr<SampleStore>(of, &of->samples()));
    if (over == CoarseFaces::of_proxy) one->drawn_for = of.get();
  }
  return *one;
}

Bundle Warper::Impl::without_maps() const {
  Bundle bundle;
  bundle.proxy = shell.shell().proxy();
  bundle.skin = shell.shell().skin();
  bundle.cameras = cameras;
  bundle.base = base.layer();
  bundle.lighting = lighting;
  return bundle;
}

// The passes of a frame, in the order of the module's rooms: what one returns the next ones need.
DrawReport Warper::Impl::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                              const DrawOptions& options, Frame& frame, bool continued) {
  const Intrinsics& lens = view.camera.intrinsics;
  frame.resize(lens.width, lens.height, options.needs_depth(), options.keep_bound);
  frame.bound_as_drawn = options.bind_as_drawn;
  const TileGrid grid(lens.width, lens.height);
  DrawReport report;
  PhaseClock clock(options.measure);
  shell.pose(positions, options.folds);
  report.weights = drawn_shares(cameras.manifold, view);
  store->require(used_cameras(report.weights));
  active.choose(*store, report.weights);
  report.texel_mm = active.texel_mm();
  if (continued) post_process.undo(frame);
  place_faces(view, options, report.texel_mm, continued);
  VisibilitySummary visibility = active.place(faces, view, grid, dirty_cells, report);
  clock.lap(report.times.transform, report.critical_path.transform);
  double reference_mm = 0;
  const std::array proxies = {&metered};
  const ScopeLight scope = lighting && lighting->scope ? *lighting->scope : ScopeLight();
  parallel_both([&] { base.place(faces, cut, view, grid, dirty_cells, visibility, report); },
                [&] { reference_mm = metered_mm(scope, proxies, view, options); });
  if (options.relights())
    relit->light_faces(view, *options.light, reference_mm, shell, visibility.shown);
  clock.lap(report.times.base, report.critical_path.base);
  draw_tiles(view, grid, options, frame, report);
  tiles.count(clock.lap(), report);
  count_pixels(frame, visibility.box, report);
  clock.lap(report.times.fill, report.critical_path.fill);
  post_process.apply(view, options, visibility.box, depth, kStepTexels * report.texel_mm, frame,
                     report);
  return report;
}

void Warper::Impl::place_faces(const View& view, const DrawOptions& options, float texel_mm,
                               bool continued) {
  std::vector<std::uint8_t> turned;
  parallel_both([&] { faces.place(shell, view, texel_mm, continued); },
                [&] {
                  if (options.relights()) turned = relit->turn(shell);
                });
  if (!turned.empty()) faces.add_moved(turned);
  dirty_cells.reset(view.camera.intrinsics.width, view.camera.intrinsics.height, !continued);
}

// Draws the tiles, or parts of them, in which something moved.
void Warper::Impl::draw_tiles(const View& view, const TileGrid& grid, const DrawOptions& options,
                              Frame& frame, DrawReport& report) {
  // Farther away lies no skin, poked skin within reason included.
  const double away_mm = (view.camera.center_world_mm() - organ.center()).norm();
  depth.resize(frame.color.width, frame.color.height,
               static_cast<float>(away_mm + organ.diagonal()));
  report.tiles_drawn = tiles.draw({.view = view,
                                   .cameras = active.all(),
                                   .texel_mm = report.texel_mm,
                                   .base = base,
                                   .faces = faces,
                                   .relit = options.relights() ? &*relit : nullptr,
                                   .keep_bound = options.keep_bound,
                                   .coarser = options.bind_as_drawn ? nullptr : drawn_for,
                                   .background = Background(options.background),
                                   .measure = options.measure},
                                  grid, dirty_cells, depth, frame);
  report.tiles_kept = grid.count() - report.tiles_drawn;
}

Warper::Warper(const Bundle& bundle)
    : Warper(bundle, [&bundle](std::size_t camera) { return bundle.maps.at(camera); }) {
  bind_all();  // while the bundle is there
}
Warper::Warper(const Bundle& bundle, ReadMaps read) {
  check_fit(bundle);
  impl_ = std::make_unique<Impl>(bundle, nullptr);
  // Without holding on to the bundle.
  SampleStore::Make bind = [read = std::move(read), cameras = bundle.cameras.cameras,
                            rest = impl_->rest](std::size_t c) {
    CameraMaps maps = read(c);
    check_maps_fit(maps, c, cameras[c].intrinsics, rest->size());
    return build_sample_set(std::move(maps), cameras[c], *rest);
  };
  impl_->store = std::make_shared<SampleStore>(bundle.cameras.cameras.size(), std::move(bind));
  impl_->coarser = std::make_shared<CoarserOrgans>(bundle.cameras.cameras, bundle.proxy.vertices);
}
Warper::Warper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Warper::~Warper() = default;
Warper::Warper(Warper&&) noexcept = default;
Warper& Warper::operator=(Warper&&) noexcept = default;

Warper Warper::cut(const Bundle& now, const CutOrgan::FaceParts& parts) const {
  const auto split = [uncut = impl_->store, parts](std::size_t camera) {
    SampleSet samples = uncut->made(camera);
    split_samples(parts, samples);
    return samples;
  };
  auto store = std::make_shared<SampleStore>(now.cameras.cameras.size(), split);
  return Warper(std::make_unique<Impl>(now, std::move(store), impl_.get(), parts));
}

Warper Warper::beside(const Bundle& bundle) const {
  auto impl = std::make_unique<Impl>(bundle, impl_->store);
  impl->coarser = impl_->coarser;
  return Warper(std::move(impl));
}

DrawReport Warper::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                        const DrawOptions& options, Frame& frame) {
  view.check();
  check_positions(positions, impl_->shell.shell().proxy());
  if (options.relights() && !impl_->relit)
    throw UsageError(
        "the bundle does not say in what light its colours were taken, or has no base layer: its "
        "skin cannot be lit anew; bake it with a lighting.json, or draw it with the baked light");
  const Impl& before = impl_->last_drawn ? *impl_->last_drawn : *impl_;
  const bool unmoved = positions == before.shell.proxy_positions();
  Impl& drawn = impl_->for_view(positions, view, options.folds);
  impl_->last_drawn = &drawn == impl_.get() ? nullptr : &drawn;
  const bool still = unmoved && &drawn == &before;
  if (still)
    if (const auto report = drawn.last.unchanged(view, options, frame)) return *report;
  // Forgotten while the next is drawn: what fails may have posed the organ otherwise.
  LastDrawing last = std::exchange(drawn.last, LastDrawing());
  const DrawReport report =
      drawn.draw(positions, view, options, frame, last.continues(view, options, frame));
  last.remember(view, options, report, still, frame);
  drawn.last = std::move(last);
  return report;
}

OrganSource Warper::pose(const std::vector<Eigen::Vector3d>& positions, bool lit,
                         const std::vector<SkinFold>& folds) {
  check_positions(positions, impl_->shell.shell().proxy());
  impl_->last_drawn = nullptr;
  impl_->last = LastDrawing();  // what is posed here is drawn elsewhere
  impl_->shell.pose(positions, folds);
  OrganSource source{.id = impl_->id,
                     .pose = impl_->shell.poses(),
                     .manifold = impl_->cameras.manifold,
                     .at_rest = impl_->organ,
                     .shells = impl_->shell.matrices(),
                     .two_sided = impl_->shell.two_sided(),
                     .cut = impl_->cut,
                     .base = impl_->base.layer()};
  if (!impl_->relit) return source;
  RelitSkin& relit = *impl_->relit;
  if (lit) relit.turn(impl_->shell);
  const NormalTransport& turns = relit.turns();
  source.lighting = &relit.lighting();
  source.rest_normals = relit.rest_normals();
  source.bends = relit.bends();
  source.rest_shells = turns.rest();
  source.knots = turns.knots_in_use();
  source.knots_of_face = turns.knots_of_faces();
  source.turns = turns.turns();
  return source;
}

std::uint64_t Warper::id() const { return impl_->id; }

const SampleSet& Warper::samples(std::size_t camera) { return impl_->store->made(camera); }

ScopeShading Warper::scope_shading(const View& view, double reference_mm) const {
  ScopeShine shine = impl_->relit.value().shine();
  shine.look(view, reference_mm);
  return shine.shading();
}

bool Warper::can_relight() const { return impl_->relit.has_value(); }

DrawnLight Warper::default_light() const {
  if (!impl_->relit) return DrawnLight::baked;
  return impl_->lighting->scope ? DrawnLight::scope : DrawnLight::world;
}
const std::vector<ShellMatrix>& Warper::shell_matrices() const {
  if (const Impl* drawn = impl_->last_drawn)  // which posed the organ instead
    if (impl_->shell.pose(drawn->shell.proxy_positions(), drawn->shell.folds()))
      impl_->last = LastDrawing();  // which is of another pose
  return impl_->shell.matrices();
}
DrawnSkin Warper::drawn_skin() const {
  const Impl& drawn = impl_->last_drawn ? *impl_->last_drawn : *impl_;
  return {drawn.base.layer(), drawn.shell.matrices(),
          drawn.drawn_for ? drawn.drawn_for->cut_into() : 1};
}
void Warper::bind_all() { impl_->store->require_all(); }
void Warper::bind_ahead() { impl_->store->make_ahead(); }
bool Warper::bind_next() { return impl_->store->make_next(); }

// Shaders take every number from the code that the processor runs.
std::vector<ShaderConstant> shader_constants() {
#define NAMED(constant) {#constant, constant}
  std::vector<ShaderConstant> all = {NAMED(kReach),           NAMED(kTieTexels),
                                     NAMED(kMostSplat),       NAMED(kNearTexel_px),
                                     NAMED(kFullCoordinate),  NAMED(kBaseWeight),
                                     NAMED(kSeenEnough),      NAMED(kStepTexels),
                                     NAMED(kWidestSlit),      NAMED(kLargestGain),
                                     NAMED(kLeastLight),      NAMED(kGrainSide),
                                     NAMED(kSharpestBend),    NAMED(kNormalReach),
                                     NAMED(kSteepestNormal),  NAMED(kShadeReach_mm),
                                     NAMED(kLampRadius_mm),   NAMED(kLeastSoft_mm),
                                     NAMED(kDarkestShadow),   NAMED(kOccluded),
                                     NAMED(kOccludedNear_mm), NAMED(kOccludedByRadius),
                                     NAMED(kDarkestDent),     NAMED(kDentReach),
                                     NAMED(kMirrorReach_mm),  NAMED(kWaterMirror),
                                     NAMED(kSteelLit),        NAMED(kTissueMirrored),
                                     NAMED(kBloodBelow),      NAMED(kBloodAbove),
                                     NAMED(kBloodPool_mm),    NAMED(kBloodBulge),
                                     NAMED(kBloodClear_mm),   NAMED(kBlood),
                                     NAMED(kBloodDull),       NAMED(kBloodShiny),
                                     NAMED(kBloodShine),      NAMED(kSmokeLight)};
#undef NAMED
  const std::vector<ShaderConstant> shine = ScopeShine::constants();
  all.insert(all.end(), shine.begin(), shine.end());
  return all;
}

}  // namespace organbake
