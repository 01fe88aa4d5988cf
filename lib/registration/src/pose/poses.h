// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "appearance/prediction.h"
#include "cost_functions/cost_functions.h"
#include "organbake/core/run_context.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

// What a finished pose must keep to.
struct VerdictRule {
  bool broken;
  Verdict verdict;  // if it is
  std::string reason;
};

// The first broken rule tells the verdict.
inline void judge_by(std::span<const VerdictRule> rules, PoseQuality& quality) {
  quality.verdict = Verdict::ok;
  quality.reason.clear();
  for (const VerdictRule& rule : rules) {
    if (!rule.broken) continue;
    quality.verdict = rule.verdict;
    quality.reason = rule.reason;
    return;
  }
}

struct RefineState;

struct RefineOptions {
  LightModel light = LightModel::camera;
  // One correlation for the whole picture on all levels. Else the two finest levels take it patch
  // by patch, the finest only where no one gain fits all patches.
  bool whole_picture = false;
  int patch_px = 24;
  bool free_focal = false;
  bool check_focal = true;    // of a finished pose
  int outer_iterations = 4;   // overlap, light and weights anew, per level
  int solver_iterations = 8;  // within each
  // Adds what else is known of the pose to each problem before it is solved.
  std::function<void(const RefineState&, LevelProblem&)> add_terms;
};

// Where the solver stands: pose, light, focal scale, and what the last overlap said of them.
struct RefineState {
  SolverState solver;
  Appearance appearance;
  double correlation = -1;  // R over the last overlap, weighted
  bool usable = false;      // the organ is in the picture, and the photograph is not constant there
};

// The basis for a surface's pose: falloff 1 at the organ's centre.
ShadingBasis basis_for(const RefineOptions& options, const ObjectPose& pose);

// Whether a pose has the surface's centre well before the camera, and is finite.
bool in_front(const RegisteredSurface& surface, const ObjectPose& pose);

// Climbs R coarse to fine, over levels first … last of a pyramid (finest first in memory, so
// first ≥ last), from the state's pose; the state is left where it was when the organ is out of the
// picture.
void refine(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid, int first,
            int last, const RefineOptions& options, RefineState& state, const RunContext& context);

// What a level says of a state whose pose stands: its light, the appearance and R.
void appraise(const RegisteredSurface& surface, const PhotoLevel& level,
              const RefineOptions& options, RefineState& state);

// (JᵀJ) of r by the motion (and ln f last when asked) and its parts by patch, of the state's R on a
// level: what the covariance is made of.
struct Curvature {
  Eigen::MatrixXd information;                // 6 × 6 or 7 × 7, light marginalised
  std::vector<Eigen::VectorXd> patch_slopes;  // Jᵀr of each patch
  std::size_t pixels = 0;
};
Curvature curvature(const RegisteredSurface& surface, const PhotoLevel& level,
                    const RefineOptions& options, const RefineState& state);

// One light that a photograph was explained by.
struct LightTrial {
  LightModel model = LightModel::camera;
  RefineState state;  // refined under it
  // RMS of the organ's pixels about what a light predicts of them that was fitted to other pixels:
  // squares of the picture take turns, as a chessboard's. A light that only has more freedom
  // predicts no better what it wasn't fitted to, so nothing else punishes its freedom. Share of the
  // luminance range; infinite when the organ is out of the picture.
  double held_out_rms = 0;
};

// Refines each of `states` (under the model of the same number) from level `first` to `last`, and
// tells how well each predicts there.
std::vector<LightTrial> try_lights(const RegisteredSurface& surface,
                                   const std::vector<PhotoLevel>& pyramid, int first, int last,
                                   const RefineOptions& options,
                                   const std::vector<LightTrial>& starts,
                                   const RunContext& context);

// The first, in the order given, that predicts about as well as the best: the simplest comes first.
const LightTrial& simplest_of_best(const std::vector<LightTrial>& trials);

// Standard deviations of a pose: of its place, its turn, and the surface's points; by the
// covariance of its motion, or by what a photograph says of that.
void measure_spread(const RegisteredSurface& surface, const Eigen::Matrix<double, 6, 6>& covariance,
                    const ObjectPose& pose, PoseQuality& quality);
void measure_spread(const RegisteredSurface& surface, const Curvature& curvature,
                    const ObjectPose& pose, PoseQuality& quality);

// Everything that is asked of a finished pose, and the verdict over it.
PoseQuality assess(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                   const RefineOptions& options, const RefineState& state, double runner_up_margin,
                   const RunContext& context);

// What the photograph says of the focal length when it may differ from the given one: found
// together with the pose. Distance stands in for most of it, and an unmodelled light for some, so
// its own standard deviation comes with it.
struct FocalCheck {
  double log_scale = 0;  // ln of what the given one should be multiplied by
  double log_sd = 0;     // infinite when it cannot be told
};

FocalCheck check_focal(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                       RefineOptions options, const RefineState& state, const RunContext& context);

// What stands out from the background that the picture's border shows.
struct Foreground {
  double area_px = 0;
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
};

// By which light a pose is told from others. All round, photographs under a studio's lights need
// the whole basis; near a start so many lights would explain a cluttered ground as well as the
// organ.
enum class ScoredBy { lamp, whole_basis };

// The share of the photograph's variance that light and background explain over all that counts: R²
// at the best weights of the light, offset and background level. What is far off costs no more than
// so much, so that an instrument draws no pose its way. Negative when a lamp alone would have to
// darken.
double explained(const PhotoLevel& level, const Prediction& prediction, ScoredBy by);

// Poses to try on one level of a photograph. Where the organ stands out from a plain background,
// its area and centre say distance and place. Threads across poses; ordered, so repeatable.
class PoseCandidates {
 public:
  // All outlive the candidates.
  PoseCandidates(const RegisteredSurface& surface, const PhotoLevel& level,
                 const RefineOptions& options, const RunContext& context);

  // From directions all round, in all rolls; where the organ does not stand out, at a grid of
  // places and sizes.
  std::vector<ObjectPose> all_round() const;
  // Turned from a start by up to 0.5 rad about axes all round; where the start puts the organ, and
  // where it stands out when it does.
  std::vector<ObjectPose> near(const ObjectPose& start) const;
  // What each explains, in their order.
  std::vector<double> scores(const std::vector<ObjectPose>& poses, ScoredBy by) const;

 private:
  // A rotation, and the area and centre that its picture has at the usual distance.
  struct View {
    Eigen::Quaterniond rotation;
    double area_px = 0;
    Eigen::Vector2d offset = Eigen::Vector2d::Zero();  // of the picture's centre from the organ's,
                                                       // normalised
  };

  Prediction picture(const PhotoLevel& level, const ObjectPose& pose) const;
  double usual_distance() const;
  View view(const Eigen::Quaterniond& rotation) const;
  std::vector<View> views(const std::vector<Eigen::Quaterniond>& rotations) const;
  std::vector<ObjectPose> around(int direction_count, int rolls,
                                 const std::vector<Foreground>& places) const;
  ObjectPose placed(const View& view, double roll, const Foreground& place) const;

  const RegisteredSurface& surface_;
  const PhotoLevel& level_;
  const RefineOptions& options_;
  const RunContext& context_;
  PhotoLevel centered_;  // its lens and rays with the axis in the middle; no photograph
  std::optional<Foreground> seen_;
};

// camera_from_world of at least six pairs that do not lie in one plane, of which most were clicked
// right. Throws UsageError for fewer pairs or a degenerate set.
RigidTransform pose_from_pairs(const std::vector<PointPair>& pairs, const Intrinsics& intrinsics);

// The best, first of all, of those items that are apart from all better ones; `count` at most.
template <class Item, class Cost, class Apart>
std::vector<Item> best_apart(std::vector<Item> items, std::size_t count, const Cost& cost,
                             const Apart& apart) {
  std::ranges::stable_sort(items, {}, cost);
  std::vector<Item> best;
  for (const Item& item : items) {
    if (best.size() == count) break;
    if (std::ranges::all_of(best, [&](const Item& known) { return apart(known, item); }))
      best.push_back(item);
  }
  return best;
}

struct SearchResult {
  RefineState best;
  int level = 0;                // of the pyramid that the best was refined to
  double runner_up_margin = 1;  // of PoseQuality
};

// Finds the pose without any start: small renderings from directions all round, in all rolls,
// correlated with the coarsest level; the best distinct ones are refined level by level and thinned
// out. Where the organ stands out from a plain background, its area and centre say distance and
// place; else a grid of both is tried as well. Threads across candidates; ordered, so repeatable.
SearchResult search_all_round(const RegisteredSurface& surface,
                              const std::vector<PhotoLevel>& pyramid, const RefineOptions& options,
                              const RunContext& context);

// Refines a given start on the coarsest level, and looks nowhere else.
SearchResult search_here(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                         const RigidTransform& start, const RefineOptions& options,
                         const RunContext& context);

// Refines a given start on the coarsest level; when that does not explain the photograph, together
// with the best of starts turned about it: a wider capture range.
SearchResult search_near(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                         const RigidTransform& start, const RefineOptions& options,
                         const RunContext& context);

}  // namespace organbake
