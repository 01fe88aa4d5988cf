// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "measuring/known_poses.h"
#include "organbake/registration/overlay.h"
#include "promises.h"
#include "registration_cases.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

constexpr double kRight_mm = 1;  // mTRE: 1 % of an organ

// What became of some cases with one lens.
struct Tally {
  int cases = 0, right = 0, right_and_ok = 0, false_ok = 0, not_ok = 0, focal_alarms = 0;
  std::vector<double> right_mtre_mm;

  void add(const RegisteredSurface& surface, const RegistrationCase& made,
           const RegisteredPhoto& found) {
    const double mtre_mm =
        mean_distance_mm(surface, made.camera_from_world, found.camera.camera_from_world);
    const bool ok = found.quality.verdict == Verdict::ok;
    ++cases;
    not_ok += !ok;
    false_ok += ok && mtre_mm > kRight_mm;
    focal_alarms += found.quality.reason.find("focal length") != std::string::npos;
    if (mtre_mm > kRight_mm) return;
    ++right;
    right_and_ok += ok;
    right_mtre_mm.push_back(mtre_mm);
  }
  double percent(int count, int of) const { return of > 0 ? 100.0 * count / of : 100; }
};

Tally of_whole_organs(const RegistrationCases& cases, int poses, double lens) {
  Tally tally;
  for (int light = 0; light < kStudioLights; ++light)
    for (int i = 0; i < poses; ++i) {
      const std::size_t organ = static_cast<std::size_t>(i) % cases.organs().size();
      const auto seed = static_cast<std::uint64_t>(1000 * light + i);
      RegistrationCase made = cases.whole_organ(organ, static_cast<StudioLight>(light), seed);
      const double factor = i % 2 == 0 ? lens : 1 / lens;
      made.photo.intrinsics.fx *= factor;
      made.photo.intrinsics.fy *= factor;
      const RegisteredSurface& surface = *cases.organs()[organ].whole;
      tally.add(surface, made, register_photo(surface, made.photo, {}));
    }
  return tally;
}

TEST(RegistrationLights, OfFourKindsLeaveItRight) {
  const RegistrationCases organs(shared_data(""));
  const int poses = cases(12, 50);
  const Tally exact = of_whole_organs(organs, poses, 1);
  const std::string what = "four kinds of light × " + std::to_string(poses) + " poses of " +
                           std::to_string(organs.organs().size()) + " organs";
  expect({what + ": right (mTRE ≤ 1 mm)", "%", exact.percent(exact.right, exact.cases), 95,
          Figure::Goal::at_least});
  expect({what + ": right ones that are ok", "%", exact.percent(exact.right_and_ok, exact.right),
          95, Figure::Goal::at_least});
  expect({what + ": wrong ones that are ok", "", double(exact.false_ok), 0});
  expect(
      {what + ": exact lens called wrong", "%", exact.percent(exact.focal_alarms, exact.cases), 2});
  if (exact.right > 0)
    expect(
        {what + ": mTRE of right ones, median", "mm", spread_of(exact.right_mtre_mm).median, 0.15});
  const Tally wrong = of_whole_organs(organs, poses, 1.2);
  expect({what + ", lens 20 % off: not ok", "%", wrong.percent(wrong.not_ok, wrong.cases), 95,
          Figure::Goal::at_least});
  const Tally slightly = of_whole_organs(organs, cases(3, 50), 1.1);
  expect({what + ", lens 10 % off: not ok", "%", slightly.percent(slightly.not_ok, slightly.cases),
          0, Figure::Goal::at_least});
}

TEST(RegistrationLights, OfOpenPatchesLeaveItRight) {
  const RegistrationCases organs(shared_data(""));
  const int count = cases(9, 30);
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const std::size_t organ = static_cast<std::size_t>(i) % organs.organs().size();
    const RegistrationCase made = organs.open_patch(organ, static_cast<std::uint64_t>(i));
    const RegisteredPhoto found = register_photo(*made.patch, made.photo, {});
    tally.add(*made.patch, made, found);
    if (i == 0) show(draw_overlay(*made.patch, made.photo.image, found, {}), "An open patch");
  }
  const std::string what = std::to_string(count) + " open patches from 10 mm / 8°";
  expect({what + ": mTRE ≤ 1 mm", "%", tally.percent(tally.right, tally.cases), 80,
          Figure::Goal::at_least});
  expect({what + ": wrong ones that are ok", "", double(tally.false_ok), 0});
}

}  // namespace
}  // namespace organbake
