// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/breath.h"

#include <Eigen/Geometry>

#include "organbake/bundle/json_fields.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

Breath some_breath() {
  Breath breath;
  breath.period_frames = 24.7;
  breath.waves << -0.5, 0.1, 0.15, -0.02;
  breath.rest = 0.4;
  for (int k = 0; k < Breath::kTerms; ++k) breath.field.col(k) << 3.0 / (k + 1), -1 + 0.2 * k, 0.5;
  breath.middle << 10, -20, 60;
  breath.reach = 35;
  return breath;
}

TEST(Breath, MovesWithItsTissue) {
  const Breath before = some_breath();
  const RigidTransform way{
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix(),
      {5, 6, -7}};
  constexpr double kFactor = 3.5;
  Breath moved = before;
  moved.move(way, kFactor);
  moved = breath_from_json(breath_to_json(moved), "breath.json");
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 50), {40, -30, 80}, {-60, 10, 20}}) {
    const Eigen::Vector3d there = kFactor * (way * place);
    const Eigen::Vector3d push = kFactor * (way.rotation * before.push(place));
    EXPECT_LT((moved.push(there) - push).norm(), 1e-9);
  }
  EXPECT_EQ(moved.course(7.5), before.course(7.5));
}

TEST(Breath, BecomesAScriptOfOnePeriod) {
  const Breath breath = some_breath();
  const std::vector<Eigen::Vector3d> vertices = {{0, 0, 50}, {40, -30, 80}};
  const Json script = parse_json(breath_script(breath, vertices), "script");
  EXPECT_EQ(script["frames"], 25);
  ASSERT_EQ(script["vertices_mm"].size(), 25u);
  for (const int frame : {0, 6, 24})
    for (std::size_t v = 0; v < vertices.size(); ++v)
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(
            script["vertices_mm"][std::size_t(frame)][3 * v + std::size_t(axis)].get<double>(),
            vertices[v][axis] + breath.course(frame * 24.7 / 25) * breath.push(vertices[v])[axis],
            6e-5);
}

TEST(Breath, IsRefusedByKey) {
  const std::string good = breath_to_json(some_breath());
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return message_of(ExitCode::bad_data, [&] {
      breath_from_json(text.replace(text.find(from), from.size(), to), "breath.json");
    });
  };
  EXPECT_NE(refusal("24.7", "0").find("/period_frames"), std::string::npos);
  EXPECT_NE(refusal("35", "-35").find("/reach_mm"), std::string::npos);
  EXPECT_NE(refusal("\"rest\"", "\"rset\"").find("rset"), std::string::npos);
  EXPECT_NE(refusal("\"field_mm\": [", "\"field_mm\": [[0, 0, 0],").find("/field_mm"),
            std::string::npos);
  EXPECT_NE(refusal("\"waves\": [", "\"waves\": [0,").find("/waves"), std::string::npos);
  EXPECT_NE(refusal("\"rest\": 0.4", "\"rest\": 1e300").find("/rest"), std::string::npos);
  EXPECT_NE(refusal("\"axes\": [", "\"axes\": [[0, 0, 0],").find("/axes"), std::string::npos);
}

}  // namespace
}  // namespace organbake
