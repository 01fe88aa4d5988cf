// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/motion_run.h"
#include "organbake/core/temporary_folder.h"
#include "promises.h"

namespace organbake {
namespace {

// No shape may be told from a clip without parallax; what it falls back to is the recipe's affair.
struct ClipWithoutParallax {
  const char* name;
  std::vector<std::string> phantom;  // options of `phantom --kind laparoscopy`
};

struct MotionRefusals : testing::TestWithParam<ClipWithoutParallax> {};

TEST_P(MotionRefusals, GiveNoShape) {
  const TemporaryFolder folder;
  const auto frames = make_motion_clip(folder.path() / "clip", GetParam().phantom, {});
  const MotionRun run = run_motion(frames, {}, folder.path() / "motion", {});
  const bool has_shape = run.refusal.empty() && std::filesystem::exists(run.folder / "surface.ply");
  EXPECT_FALSE(has_shape) << "a shape where there is no parallax";
}

INSTANTIATE_TEST_SUITE_P(
    Clip, MotionRefusals,
    testing::Values(ClipWithoutParallax{"still", {"--path", "still", "--no-instrument"}},
                    ClipWithoutParallax{"turn", {"--path", "turn"}},
                    ClipWithoutParallax{"zoom", {"--path", "zoom", "--no-instrument"}},
                    ClipWithoutParallax{"instrument", {"--path", "still"}}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace organbake
