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
  std::vector<ShaderConstant> all = {{"kReach", kReach},
                                     {"kTieTexels", kTieTexels},
                                     {"kMostSplat", kMostSplat},
                                     {"kNearTexel", kNearTexel_px},
                                     {"kFullCoordinate", kFullCoordinate},
                                     {"kBaseWeight", kBaseWeight},
                                     {"kSeenEnough", kSeenEnough},
                                     {"kStepTexels", kStepTexels},
                                     {"kWidestSlit", kWidestSlit},
                                     {"kLargestGain", kLargestGain},
                                     {"kLeastLight", kLeastLight},
                                     {"kGrainSide", kGrainSide},
                                     {"kSharpestBend", kSharpestBend},
                                     {"kNormalReach", kNormalReach},
                                     {"kSteepestNormal", kSteepestNormal},
                                     {"kShadeReach_mm", kShadeReach_mm},
                                     {"kLampRadius_mm", kLampRadius_mm},
                                     {"kLeastSoft_mm", kLeastSoft_mm},
                                     {"kDarkestShadow", kDarkestShadow},
                                     {"kOccluded", kOccluded},
                                     {"kOccludedNear_mm", kOccludedNear_mm},
                                     {"kOccludedByRadius", kOccludedByRadius},
                                     {"kDarkestDent", kDarkestDent},
                                     {"kDentReach", kDentReach},
                                     {"kMirrorReach_mm", kMirrorReach_mm},
                                     {"kWaterMirror", kWaterMirror},
                                     {"kSteelLit", kSteelLit},
                                     {"kTissueRed", kTissueMirrored[0]},
                                     {"kTissueGreen", kTissueMirrored[1]},
                                     {"kTissueBlue", kTissueMirrored[2]},
                                     {"kBloodBelow", kBloodBelow},
                                     {"kBloodAbove", kBloodAbove},
                                     {"kBloodPool_mm", kBloodPool_mm},
                                     {"kBloodBulge", kBloodBulge},
                                     {"kBloodClear_mm", kBloodClear_mm},
                                     {"kBloodRed", kBlood[0]},
                                     {"kBloodGreen", kBlood[1]},
                                     {"kBloodBlue", kBlood[2]},
                                     {"kBloodDull", kBloodDull},
                                     {"kBloodShiny", kBloodShiny},
                                     {"kBloodShine", kBloodShine},
                                     {"kSmokeRed", kSmokeLight[0]},
                                     {"kSmokeGreen", kSmokeLight[1]},
                                     {"kSmokeBlue", kSmokeLight[2]}};
  const std::vector<ShaderConstant> shine = ScopeShine::constants();
  all.insert(all.end(), shine.begin(), shine.end());
  return all;
}

std::span<const std::int8_t> grain_noise() {
  return {GrainTable::shared().data(), std::size_t(kGrainSide) * kGrainSide * kGrainSide};
}

}  // namespace organbake
