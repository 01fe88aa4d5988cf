// SPDX-License-Identifier: Apache-2.0
// Hands an organ's samples and the drawing's constants to another way of drawing, so that shaders
// take every number from the code that the processor runs.
#include "organbake/warp/organ_source.h"

#include "drawing/base_drawing.h"
#include "drawing/splat.h"
#include "finishing/edges.h"
#include "finishing/post_process.h"
#include "light/relit_skin.h"
#include "light/scope_shine.h"
#include "placing/placing.h"

namespace organbake {

static_assert(kGrainSide == GrainTable::kSide);

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

std::span<const std::int8_t> grain_noise() {
  return {GrainTable::shared().data(), std::size_t(kGrainSide) * kGrainSide * kGrainSide};
}

}  // namespace organbake
