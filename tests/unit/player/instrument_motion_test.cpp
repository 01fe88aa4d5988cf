// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/instrument_motion.h"

#include <gtest/gtest.h>

#include <string>

#include "organ_to_play.h"
#include "organbake/core/error.h"
#include "organbake/player/skin_point.h"

namespace organbake {
namespace {

// The base layer's lattice has steps of 3 mm on a body with radii of 45–60 mm: its chords lie up to
// 3²/(8·45) mm below the formula's surface, lumps add as much again.
constexpr double kLatticeMm = 0.3;

TEST(SkinPoint, LiesOnTheOrgan) {
  const SyntheticOrgan& organ = organ_options().organ;
  for (const Eigen::Vector3d& d :
       {Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-1, 0.2, -0.7)}) {
    const Eigen::Vector3d unit = d.normalized();
    const Eigen::Vector3d skin = skin_point(organ_to_play(), d);
    EXPECT_LT(((skin - organ.center).normalized() - unit).norm(), 1e-9);
    EXPECT_NEAR((skin - organ.center).norm(), organ.radius(unit), kLatticeMm);
  }
}

TEST(InstrumentMotion, PutsTheTipsSurfaceAtTheDepth) {
  Script script;
  const Eigen::Vector3d front(0, -1, 0);
  script.instruments = {
      {"p", {.radius_mm = 6}, {{1, std::nullopt, front, 4}, {2, std::nullopt, front, 8}}}};
  const InstrumentMotion motion(script, organ_to_play());
  EXPECT_FALSE(motion.at(0.9)[0].active);
  EXPECT_FALSE(motion.at(2.1)[0].active);
  const Instrument tip = motion.at(1.5)[0];
  ASSERT_TRUE(tip.active);
  const Eigen::Vector3d skin = skin_point(organ_to_play(), front);
  EXPECT_NEAR((tip.position_mm - skin).dot(front), 6 - 6,
              1e-9);  // centre: radius − depth above skin
}

TEST(InstrumentMotion, NamesTheDirectionThatMeetsNoSkin) {
  Bundle beside = organ_to_play();
  beside.cameras.manifold.center_world_mm.x() += 1000;
  Script script;
  script.name = "away";
  const Eigen::Vector3d at(1, 2, 3), away(1, 0, 0);
  script.instruments = {{"p", {.radius_mm = 6}, {{0, at}}},
                        {"q", {.radius_mm = 6}, {{0, at}, {1, {}, away, 4}}}};
  try {
    InstrumentMotion motion(script, beside);
    FAIL() << "accepted";
  } catch (const BadDataError& error) {
    EXPECT_EQ(std::string(error.what()).find("script 'away': /instruments/1/path/1/direction: no"),
              0u)
        << error.what();
  }
}

TEST(InstrumentMotion, TakesTheBundlesToolWhenTheScriptNamesNoSize) {
  Script script;
  script.instruments = {{"p", {.radius_mm = 0}, {{0, Eigen::Vector3d(1, 2, 3)}}}};
  const InstrumentMotion motion(script, organ_to_play());
  EXPECT_EQ(motion.at(0)[0].radius_mm, organ_to_play().mechanics.instrument_radius_mm);
}

}  // namespace
}  // namespace organbake
