// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "organbake/bundle/bundle.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {

inline constexpr double kMetresAMillimetre = 0.001, kNewtonsAMetre = 1000;  // of N/mm
inline constexpr double kPascals = 1000;                                    // of kPa
inline constexpr int kAssetMetreDigits = 9;  // a millionth of a millimetre

inline std::string metres_text(const Eigen::Vector3d& v, const char* between) {
  return to_text(v.x(), kAssetMetreDigits) + between + to_text(v.y(), kAssetMetreDigits) + between +
         to_text(v.z(), kAssetMetreDigits);
}

// A bundle's tetrahedra; throws UsageError where there are none.
inline const TetrahedralBody& tetrahedra_of(const Bundle& bundle, std::string_view what) {
  if (bundle.mechanics.body) return *bundle.mechanics.body;
  throw UsageError(std::string(what) + " is made of tetrahedra, which '" + bundle.manifest.name +
                   "' does not have; bake it anew without --set mechanics.fem=false");
}

}  // namespace organbake
