// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>

#include "measuring/error_measures.h"
#include "organbake/core/text.h"
#include "organbake/phantom/known_answers.h"
#include "organbake/shading/laparoscope.h"
#include "organbake/shading/light_estimate.h"
#include "organbake/shading/light_ratio.h"
#include "promises.h"

namespace organbake {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(LightDirection, IsFoundFromOnePicture) {
  for (const std::string& name : distant_scene_names()) {
    double sum = 0, worst = 0;
    for (int tilt = 0; tilt < 8; ++tilt)
      for (double slant : {15., 30., 45., 60.}) {
        const DistantLight light{tilt * 45 * kDegree + 0.1, slant * kDegree};
        const DistantScene scene = distant_scene(name, 128, light);
        DistantLight found = estimate_light(scene.intensity, Mask(128, 128, 1)).light;
        const auto angle = [&] {
          return std::acos(std::clamp(found.toward().dot(light.toward()), -1.0, 1.0)) / kDegree;
        };
        double error = angle();
        found.tilt_rad += std::numbers::pi;  // the flip, which no picture tells
        error = std::min(error, angle());
        sum += error;
        worst = std::max(worst, error);
      }
    const bool promised = name == "vase" || name == "sphere" || name == "gauss";
    const std::string what = "light direction, " + name + (promised ? "" : " (reported)");
    expect({what + ": mean of 32", "°", sum / 32, promised ? 5. : 50.});
    expect({what + ": worst", "°", worst, promised ? 15. : 90.});
  }
}

// Of a lamp that sits so far beside the lens, given or taken for one at the lens.
double range_error_beside(double offset_mm, bool given) {
  constexpr double kMedian_mm = 60;
  const NearScene scene = near_scene(0.5, 128);
  const LaparoscopeOptions beside{.light_offset_x_mm = offset_mm};
  Plane lit = scene.intensity;
  const Plane ratio = light_ratio(scene.log_range, ray_grid(scene.camera), beside);
  for (std::size_t k = 0; k < ratio.size(); ++k) lit.values[k] *= ratio.values[k];
  const RangeEstimate found =
      shade_laparoscope(lit, Mask(128, 128, 1), scene.camera, given ? beside : LaparoscopeOptions(),
                        nullptr, given ? kMedian_mm : 0);
  return range_error_percent(found.log_range, scene.log_range);
}

TEST(LightBesideTheLens, IsWorthGiving) {
  for (const double offset_mm : {2.0, 4.0, 6.0, 8.0, 10.0}) {
    const double taken_for_central = range_error_beside(offset_mm, false);
    const std::string what = "light " + to_text(offset_mm) + " mm beside the lens: depth error, ";
    report(what + "taken for central", "%", taken_for_central);
    expect({what + "offset given", "%", range_error_beside(offset_mm, true), taken_for_central});
  }
}

}  // namespace
}  // namespace organbake
