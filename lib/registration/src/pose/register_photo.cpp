// SPDX-License-Identifier: GPL-3.0-or-later
// The stage's order: a start or a search, the choice of the light, refinement, verdict; and, where
// the pose is not ok, other lights and the organ's colours.
#include "organbake/registration/register_photo.h"

#include <algorithm>
#include <cmath>

#include "color/tissue.h"
#include "depth/depth_alignment.h"
#include "organbake/core/error.h"
#include "organbake/geometry/rigid_transform.h"
#include "pose/poses.h"

namespace organbake {
namespace {

constexpr int kCoarsestSide = 64;  // pixels: the level that starts are refined on
// Of an open surface little but its relief and what it has of outlines says where it is, and small
// pictures have neither; what looks a little like it is found everywhere, so that no other place
// than the start's is tried.
constexpr int kCoarsestSideOpen = 160;
constexpr int kSearchCoarsestSide = 48;  // and that a search all round looks at

void check_photo(const PhotoToRegister& photo) {
  photo.intrinsics.check();
  // A typing error in the units should be told here, not as a pose that is not found.
  if (photo.start && !within_reach(photo.start->translation))
    throw BadDataError("the start is not within 1e9 mm; check its units");
  const auto size = [](int width, int height) {
    return std::to_string(width) + "×" + std::to_string(height);
  };
  const Intrinsics& k = photo.intrinsics;
  if (photo.image.width != k.width || photo.image.height != k.height) {
    throw BadDataError("the photograph has " + size(photo.image.width, photo.image.height) +
                       " pixels, its intrinsics are for " + size(k.width, k.height));
  }
  const bool masked = !photo.mask.pixels.empty();
  if (masked && (photo.mask.width != k.width || photo.mask.height != k.height)) {
    throw BadDataError("the mask has " + size(photo.mask.width, photo.mask.height) +
                       " pixels, the photograph " + size(k.width, k.height));
  }
}

// The lights that `automatic` chooses from, the simplest first.
constexpr LightModel kLights[] = {LightModel::camera, LightModel::beam, LightModel::estimated};
constexpr int kEnoughForLight = 160;  // pixels of the longer side: the light shows here, too

SearchResult search(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                    const std::optional<RigidTransform>& start, SearchRange range,
                    RefineOptions options, const RunContext& context) {
  options.free_focal = false;  // the rough pose first, then the lens
  if (start && (range == SearchRange::one_frame || surface.open()))
    return search_here(surface, pyramid, *start, options, context);
  return start ? search_near(surface, pyramid, *start, options, context)
               : search_all_round(surface, pyramid, options, context);
}

// Each light explains the photograph as well as it can, on a level of moderate size; the light that
// is chosen stands in `options`, the others in `left`.
SearchResult search_with_any_light(const RegisteredSurface& surface,
                                   const std::vector<PhotoLevel>& pyramid,
                                   const std::optional<RigidTransform>& start, SearchRange range,
                                   RefineOptions& options, std::vector<LightTrial>& left,
                                   const RunContext& context) {
  options.light = LightModel::camera;
  SearchResult at_lens = search(surface, pyramid, start, range, options, context);
  options.light = LightModel::estimated;
  SearchResult anywhere = search(surface, pyramid, start, range, options, context);
  std::vector<LightTrial> starts;
  // A lamp with a beam is sought from where one at the lens has led: they differ at the rim alone.
  for (const LightModel model : kLights)
    starts.push_back({model, model == LightModel::estimated ? anywhere.best : at_lens.best});
  int level = std::min(at_lens.level, anywhere.level);
  while (level > 0 && pyramid[level].intrinsics.width < kEnoughForLight) --level;
  RefineOptions trying = options;
  trying.free_focal = false;
  left = try_lights(surface, pyramid, std::max(at_lens.level, anywhere.level), level, trying,
                    starts, context);
  const LightTrial chosen = simplest_of_best(left);
  std::erase_if(left, [&](const LightTrial& trial) { return trial.model == chosen.model; });
  options.light = chosen.model;
  SearchResult result = chosen.model == LightModel::estimated ? anywhere : at_lens;
  result.best = chosen.state;
  result.level = level;
  return result;
}

// A piece of an organ is what a laparoscope sees from near: texture drowns its relief, so that it
// is sought with a model of tissue, unless the light or the similarity is chosen.
bool seen_as_tissue(const RegisteredSurface& surface, const std::optional<RigidTransform>& start,
                    const RegistrationOptions& o) {
  return start && surface.open() && o.light == LightModel::automatic &&
         o.range == SearchRange::wide && o.similarity == Similarity::radiance && !o.free_focal;
}

// Stays on the finest level; the light that tissue is seen under is a lamp near the lens.
SearchResult search_as_tissue(const RegisteredSurface& surface, const Rgb8Image& photo,
                              const std::vector<PhotoLevel>& pyramid, const RigidTransform& start,
                              RefineOptions& options, const RunContext& context) {
  SearchResult result;
  options.light = LightModel::beam;
  const auto pose =
      search_tissue(surface, photo, pyramid, object_pose(start, surface.center()), context);
  if (!pose) return result;
  result.best.solver.pose = pose->to_array();
  appraise(surface, pyramid.front(), options, result.best);
  return result;
}

// Where outlines confirm a pose that shading and colour found, they also have the last word. That
// they take it somewhere else means that one of the two is misled.
PoseQuality finish_by_outlines(const RegisteredSurface& surface,
                               const std::vector<PhotoLevel>& pyramid, const RefineOptions& options,
                               const PoseQuality& quality, RefineState& state,
                               const RunContext& context) {
  constexpr double kApart_mm = 1.5;
  const auto placed = [&](const RefineState& at) {
    return rigid_transform(at.solver.object_pose(), surface.center());
  };
  RefineState finished = state;
  refine(surface, pyramid, std::min<int>(1, static_cast<int>(pyramid.size()) - 1), 0, options,
         finished, context);
  PoseQuality result = quality;
  result.verdict = Verdict::doubtful;
  result.reason = "what shading and colour say and what the outline says lie apart";
  if (!finished.usable || !(surface.mean_distance_mm(placed(state), placed(finished)) < kApart_mm))
    return result;
  state = finished;
  return assess(surface, pyramid, options, state, 1, context);
}

// Where shading finds nothing, colour may: near a start, and of a whole organ, whose borders are
// its outline. What is chosen (a light, a lens, a form) is chosen for shading.
bool colors_may_tell(const RegisteredSurface& surface, const std::optional<RigidTransform>& start,
                     const RegistrationOptions& o) {
  return o.fallbacks && start && !surface.open() && o.light == LightModel::automatic &&
         o.range == SearchRange::wide && o.similarity == Similarity::radiance && !o.free_focal;
}

// An instrument in front can pass for what a beam or another light does, and then drags the pose
// with it: the other lights have their say on a pose that is not ok, and the outline, which knows
// no light, decides. What took so many tries is doubtful at best.
void let_outline_choose_light(const RegisteredSurface& surface,
                              const std::vector<PhotoLevel>& pyramid,
                              const std::vector<LightTrial>& left, int level, RefineOptions options,
                              RefineState& state, RegisteredPhoto& found,
                              const RunContext& context) {
  constexpr double kMore = 0.1;  // of the outline
  options.check_focal = false;
  for (const LightTrial& trial : left) {
    options.light = trial.model;
    RefineState other = trial.state;
    if (other.usable) refine(surface, pyramid, level, 0, options, other, context);
    const PoseQuality quality = assess(surface, pyramid, options, other, 1, context);
    if (!(quality.outline_share > found.quality.outline_share + kMore)) continue;
    state = other;
    found.light = trial.model;
    found.quality = quality;
    if (quality.verdict != Verdict::ok) continue;
    found.quality.verdict = Verdict::doubtful;
    found.quality.reason = "the light that explains the photograph best has the outline elsewhere";
  }
}

// Its outline is not where shading found the organ.
bool may_lie_elsewhere(const PoseQuality& q) {
  constexpr double kLittle = 0.5;  // of the outline
  return q.verdict == Verdict::failed ||
         (q.verdict == Verdict::doubtful && q.outline_share < kLittle);
}

bool draws_it_better(const PoseQuality& by_color, const PoseQuality& by_shading) {
  constexpr double kMore = 0.2;  // of the outline
  return by_color.verdict != Verdict::failed &&
         by_color.outline_share > by_shading.outline_share + kMore;
}

RegisteredPhoto by_silhouette(const RegisteredSurface& surface, const PhotoToRegister& photo,
                              const std::optional<RigidTransform>& start,
                              const RunContext& context) {
  if (!start) throw UsageError("a silhouette is told from its ground near a start: give one");
  if (surface.open())
    throw UsageError(
        "a piece of an organ has no silhouette of its own: does the organ end where the mesh has "
        "a border, say that its outline is closed");
  return register_by_color(surface, photo, *start, context);
}

// Without a start the photograph finds one.
RegisteredPhoto with_depth(const RegisteredSurface& surface, const PhotoToRegister& photo,
                           std::optional<RigidTransform> start, const RegistrationOptions& options,
                           const RunContext& context) {
  if (options.free_focal)
    throw UsageError("a focal length is not sought where depth is known: that holds with one lens");
  if (!start) {
    PhotoToRegister alone = photo;
    alone.depth = {};
    start = register_photo(surface, alone, options, context).camera.camera_from_world;
  }
  return register_with_depth(surface, photo, *start, options, context);
}

RefineOptions refine_options(const RegistrationOptions& o) {
  RefineOptions options;
  options.light = o.light;
  options.free_focal = o.free_focal;
  options.check_focal = o.range == SearchRange::wide;
  return options;
}

}  // namespace

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::doubtful:
      return "doubtful";
    default:
      return "failed";
  }
}

void RegistrationOptions::check() const {
  require(finest_side_px >= 64 && finest_side_px <= 8192, "finest_side", finest_side_px,
          "take 64…8192 pixels");
}

RegisteredPhoto register_photo(const RegisteredSurface& surface, const PhotoToRegister& photo,
                               const RegistrationOptions& options, const RunContext& context) {
  options.check();
  check_photo(photo);
  RegisteredPhoto result;
  result.camera.intrinsics = photo.intrinsics;
  std::optional<RigidTransform> start = photo.start;
  if (!photo.pairs.empty()) start = pose_from_pairs(photo.pairs, photo.intrinsics);
  if (start) result.camera.camera_from_world = *start;
  if (!photo.depth.empty()) return with_depth(surface, photo, start, options, context);
  if (options.similarity == Similarity::silhouette)
    return by_silhouette(surface, photo, start, context);
  const bool as_tissue = seen_as_tissue(surface, start, options);
  const std::vector<PhotoLevel> pyramid =
      photo_pyramid(photo.image, photo.mask, photo.intrinsics, options.finest_side_px,
                    !start           ? kSearchCoarsestSide
                    : as_tissue      ? kCoarsestTissueSide
                    : surface.open() ? kCoarsestSideOpen
                                     : kCoarsestSide);
  if (pyramid.empty()) {
    result.quality.reason = "the photograph is too small: at least 8 pixels a side are needed";
    return result;
  }

  RefineOptions refining = refine_options(options);
  std::vector<LightTrial> other_lights;
  SearchResult found =
      as_tissue ? search_as_tissue(surface, photo.image, pyramid, *start, refining, context)
      : options.light == LightModel::automatic
          ? search_with_any_light(surface, pyramid, start, options.range, refining, other_lights,
                                  context)
          : search(surface, pyramid, start, options.range, refining, context);
  result.light = refining.light;
  context.progress(0.4);
  RefineState& state = found.best;
  // Tissue was followed to the finest level by its own search.
  if (state.usable && !as_tissue)
    refine(surface, pyramid, found.level, 0, refining, state, context);
  context.progress(0.9);
  result.quality = assess(surface, pyramid, refining, state, found.runner_up_margin, context);
  if (as_tissue && result.quality.verdict == Verdict::ok)
    result.quality = finish_by_outlines(surface, pyramid, refining, result.quality, state, context);
  if (result.quality.verdict != Verdict::ok && options.fallbacks)
    let_outline_choose_light(surface, pyramid, other_lights, found.level, refining, state, result,
                             context);
  // The last resort: where the organ's colours are, whatever its shading says.
  if (may_lie_elsewhere(result.quality) && colors_may_tell(surface, start, options)) {
    RegisteredPhoto by_color = register_by_color(surface, photo, *start, context);
    if (draws_it_better(by_color.quality, result.quality)) return by_color;
  }
  if (!state.usable) return result;
  result.camera.camera_from_world = rigid_transform(state.solver.object_pose(), surface.center());
  result.camera.intrinsics.fx *= std::exp(state.solver.log_focal);
  result.camera.intrinsics.fy *= std::exp(state.solver.log_focal);
  return result;
}

}  // namespace organbake
