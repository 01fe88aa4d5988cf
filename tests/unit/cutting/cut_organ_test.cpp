// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/cut_organ.h"

#include "organbake/cutting/blade_sweeps.h"
#include "support/error_message.h"
#include "support/meshes.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kBoxVolume_mm3 = 60 * 40 * 40;
// Of it, what a wall's quadrangles leave of its outline.
constexpr double kWallGaps = 0.01;

// A box with tetrahedra of 10 mm, its skin the proxy itself; or a smaller one.
Bundle box_organ(double scale = 1, bool alive = false) {
  Bundle bundle;
  bundle.manifest.name = "box";
  bundle.proxy = grid_box(scale * Vector3d(60, 40, 40), 8);
  bundle.mechanics.body = test::tissue_under(bundle.proxy, 10 * scale);
  bundle.mechanics.young_modulus_kpa = 10;
  bundle.mechanics.density_kg_per_m3 = 1000;
  if (alive) {
    bundle.lighting.emplace();
    bundle.lighting->up = Vector3d::UnitX();
    bundle.lighting->finish.grain.setConstant(0.03);
  }
  return bundle;
}

class CutOrganTest : public testing::Test {
 protected:
  explicit CutOrganTest(double scale = 1, bool alive = false)
      : organ_(box_organ(scale, alive)), sweeps_(organ_) {}

  // One step of a blade in the organ at rest; whether it hangs together otherwise then.
  bool advance(const CuttingStep& now) {
    const std::vector<Vector3d> nodes =
        organ_.cut() ? organ_.now().mechanics.body->nodes_mm : organ_.body().uncut().nodes_mm;
    sweeps_.advance({&now, 1}, organ_, nodes);
    return organ_.part(sweeps_.sheet());
  }
  // A blade, its edge upright, on its way at rest.
  std::size_t draw_blade(const Vector3d& from, const Vector3d& to, double edge_mm, int steps = 40,
                         std::size_t instrument = 0, double width_mm = 0) {
    std::size_t changes = 0;
    for (int i = 0; i <= steps; ++i) {
      const Vector3d tip = from + double(i) / steps * (to - from);
      changes += advance({instrument, {tip, tip + Vector3d(0, 0, edge_mm)}, width_mm});
    }
    sweeps_.advance({}, organ_, {});
    return changes;
  }

  CutOrgan organ_;
  BladeSweeps sweeps_;
};

// Of the pieces' skins with their walls, mm³, the smaller first; no face hangs between two pieces.
std::vector<double> volumes_of_pieces(const CutOrgan& organ) {
  const CutTetrahedra& cut = organ.body().cut();
  std::vector<double> volumes(cut.fragment_count(), 0);
  const auto& at = organ.now().proxy.vertices;
  for (const auto& [a, b, c] : organ.now().proxy.faces) {
    const auto piece = [&](std::uint32_t v) {
      return cut.fragment(organ.now().mechanics.body->vertices[v].tetrahedron);
    };
    EXPECT_EQ(piece(a), piece(b));
    EXPECT_EQ(piece(a), piece(c));
    volumes[piece(a)] += at[a].cross(at[b]).dot(at[c]) / 6;
  }
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

void expect_two_pieces(const CutOrgan& organ, double smaller_mm3, double larger_mm3) {
  ASSERT_EQ(organ.body().cut().fragment_count(), 2u);
  const std::vector<double> volumes = volumes_of_pieces(organ);
  EXPECT_NEAR(volumes[0], smaller_mm3, kWallGaps * kBoxVolume_mm3);
  EXPECT_NEAR(volumes[1], larger_mm3, kWallGaps * kBoxVolume_mm3);
}

TEST(CutOrgan, OrgansWithoutTetrahedraAreRefused) {
  Bundle bundle = box_organ();
  bundle.mechanics.body.reset();
  EXPECT_THAT(message_of(ExitCode::usage, [&] { CutOrgan organ(bundle); }),
              testing::HasSubstr("mechanics.fem=false"));
}

TEST_F(CutOrganTest, ABladeInTheAirCutsNothing) {
  EXPECT_EQ(draw_blade({-50, 0, 21}, {50, 0, 21}, 30), 0u);
  EXPECT_FALSE(organ_.cut());
}

// In two from end to end: two bodies, each with its share of the skin and a wall, closed to what a
// wall's quadrangles leave of its outline.
TEST_F(CutOrganTest, ACutThroughMakesTwoBodies) {
  EXPECT_GT(draw_blade({3.3, -35, -30}, {3.3, 35, -30}, 60), 0u);
  ASSERT_TRUE(organ_.cut());
  ASSERT_EQ(organ_.now().mechanics.body->vertices.size(), organ_.now().proxy.vertices.size());
  expect_two_pieces(organ_, 26.7 * 40 * 40, 33.3 * 40 * 40);
}

// Each piece is short of its half of the strip.
TEST_F(CutOrganTest, AWideBladeTakesAStripAway) {
  draw_blade({3.3, -35, -30}, {3.3, 35, -30}, 60, 40, 0, 2);
  expect_two_pieces(organ_, 25.7 * 40 * 40, 32.3 * 40 * 40);
}

// Whether a face that looks up lies at a place, its middle between those heights.
bool meets_face(const TriangleMesh& skin, const Eigen::Vector2d& at, double low, double high) {
  return std::any_of(skin.faces.begin(), skin.faces.end(), [&](const Face& f) {
    const Vector3d &a = skin.vertices[f[0]], &b = skin.vertices[f[1]], &c = skin.vertices[f[2]];
    const auto left = [&](const Vector3d& p, const Vector3d& q) {
      const Eigen::Vector2d to = at - p.head<2>();
      return (q - p).head<2>().dot(Eigen::Vector2d(to.y(), -to.x())) > 0;
    };
    const double middle = (a + b + c).z() / 3;
    return left(a, b) && left(b, c) && left(c, a) && middle > low && middle < high;
  });
}

// The lips of a wide cut lie as far apart as it is wide, and its tip leaves a floor between the
// walls: no way leads in from above that does not meet a face.
TEST_F(CutOrganTest, AWideCutHasAFloor) {
  draw_blade({3.3, -12, 8}, {3.3, 12, 8}, 30, 40, 0, 2);
  ASSERT_TRUE(organ_.cut());
  const TriangleMesh& skin = organ_.now().proxy;
  int lips = 0;
  for (std::size_t v = 0; v < skin.vertices.size(); ++v) {
    const Vector3d& at = skin.vertices[v];
    if (!organ_.now().skin->creased[v] || std::abs(at.y()) > 8) continue;
    EXPECT_NEAR(std::abs(at.x() - 3.3), 1, 0.1);  // of a lip that is bent by 3 % of an edge
    ++lips;
  }
  EXPECT_GT(lips, 10);
  for (const double y : {-6.1, 0.2, 5.3})
    for (const double x : {2.6, 3.35, 4.0})
      EXPECT_TRUE(meets_face(skin, {x, y}, 7, 9)) << x << " " << y;
}

// Where a shallow scalpel crosses it the floor rises, and no gap is left beside.
TEST_F(CutOrganTest, AWideCutHasAFloorWhereAnotherCrosses) {
  draw_blade({3.3, -12, 8}, {3.3, 12, 8}, 30, 40, 0, 2);
  draw_blade({-8, 2.4, 14}, {15, 2.4, 14}, 30, 40, 1);
  for (double y = -6.1; y < 6; y += 0.3)
    for (const double x : {2.6, 3.35, 4.0})
      EXPECT_TRUE(meets_face(organ_.now().proxy, {x, y}, -19, 21)) << x << " " << y;
}

// Walls turn corners without folds, each side towards the way of the hook, and light falls on it as
// it lies: round a bend whose inner lips would be drawn past each other, and at the ends, where one
// side meets the other.
TEST_F(CutOrganTest, WallsTurnCornersInOrder) {
  constexpr double kWidth_mm = 1.5, kBend_mm = 0.4, kStep_mm = 0.2;
  std::vector<Vector3d> way;
  for (double y = -12.1; y < 4; y += kStep_mm) way.emplace_back(3.3, y, 8);
  for (double angle = 0; angle < 1.6; angle += 0.2)
    way.emplace_back(3.3 - kBend_mm * (1 - std::cos(angle)), 4.1 + kBend_mm * std::sin(angle), 8);
  for (double x = 2.9; x > -12; x -= kStep_mm) way.emplace_back(x, 4.1 + kBend_mm, 8);
  for (const Vector3d& tip : way) advance({0, {tip, tip + Vector3d(0, 0, 30)}, kWidth_mm});
  sweeps_.advance({}, organ_, {});
  const TriangleMesh& cut = organ_.now().proxy;
  auto first_wall = static_cast<std::uint32_t>(organ_.uncut_skin().faces.size());
  for (const auto& [face, parts] : organ_.face_parts())
    for (const CutOrgan::FacePart& part : parts) first_wall = std::max(first_wall, part.face + 1);
  constexpr std::uint32_t kSteps = 2, kNodes = 6;
  const std::vector<Vector3d> normals = CutOrgan::wall_normals(cut, first_wall, kSteps);
  ASSERT_EQ(normals.size(), (cut.faces.size() - first_wall) * kNodes);
  constexpr double kSliver_mm2 = 0.05, kRounding_mm = 1e-6;
  double area = 0;
  for (std::uint32_t f = first_wall; f < cut.faces.size(); ++f) {
    area += face_area(cut, f);
    if (face_area(cut, f) < kSliver_mm2) continue;
    const Vector3d facing = face_normal(cut, f);
    for (std::uint32_t node = 0; node < kNodes; ++node)
      EXPECT_GT(normals[(f - first_wall) * kNodes + node].dot(facing), 0);
    if (facing.z() > 0.5) continue;  // the floor
    Vector3d middle = Vector3d::Zero();
    for (const std::uint32_t v : cut.faces[f]) middle += cut.vertices[v] / 3;
    middle.z() = 8;
    const auto nearer = [&](const Vector3d& p, const Vector3d& q) {
      return (p - middle).norm() < (q - middle).norm();
    };
    EXPECT_GT(facing.dot(*std::min_element(way.begin(), way.end(), nearer) - middle), -kRounding_mm)
        << middle.transpose();
  }
  EXPECT_GT(area, 500);
}

// A blade that comes down flat on the skin: its walls are as deep as it went, below all of it.
TEST_F(CutOrganTest, ABladePressedInFlatMakesWalls) {
  for (int i = 0; i <= 40; ++i) {
    const double z = 24 - 0.4 * i;
    advance({0, {Vector3d(-14, 2.3, z), Vector3d(14, 2.3, z)}});
  }
  ASSERT_TRUE(organ_.cut());
  const TriangleMesh& skin = organ_.now().proxy;
  double area = 0;
  for (std::size_t f = 0; f < skin.faces.size(); ++f) {
    bool on_sheet = true;
    for (const std::uint32_t v : skin.faces[f])
      on_sheet = on_sheet && std::abs(skin.vertices[v].y() - 2.3) < 0.1;
    if (on_sheet) area += face_area(skin, f);
  }
  // From z = 20 down to 8, on both sides; at either end it may stop an edge of the skin short.
  EXPECT_GT(area, 2 * (28 - 2 * 2.5) * 12);
  EXPECT_LT(area, 2 * 28 * 12 * 1.001);
}

TEST_F(CutOrganTest, ScissorsPartWhatLiesBetweenTheirBlades) {
  ClosingScissors scissors;
  const Vector3d pivot(-80, 2.3, 0), tip(40, 2.3, 0);
  EXPECT_FALSE(scissors.advance(tip, pivot, {0, 0, 100}));
  EXPECT_FALSE(scissors.advance(tip, pivot, {0, 0, 120}));  // they open: nothing is cut
  for (int i = 1; i <= 40; ++i) {
    const auto snip = scissors.advance(tip, pivot, {0, 0, 120 - 3.0 * i});
    ASSERT_TRUE(snip);
    EXPECT_EQ(snip->put_down.has_value(), i == 1);
    advance({0, snip->edge, 0, snip->put_down});
    if (i < 20) {
      EXPECT_EQ(organ_.body().cut().fragment_count(), 1u);  // not half-way yet
    }
  }
  expect_two_pieces(organ_, 60 * 17.7 * 40, 60 * 22.3 * 40);
  EXPECT_FALSE(scissors.advance(tip, pivot, {0, 0, 0}));  // they stay closed
}

// Beside a cut the faces that show it are small; those of a cut skin tell where in the uncut one
// they lie, all of it once.
TEST_F(CutOrganTest, SkinIsFinerBesideACut) {
  draw_blade({3.3, -12, 8}, {3.3, 12, 8}, 30);
  const TriangleMesh& now = organ_.now().proxy;
  ASSERT_FALSE(organ_.face_parts().empty());
  EXPECT_LT(now.faces.size(), organ_.uncut_skin().faces.size() + 1500);
  for (const auto& [face, parts] : organ_.face_parts()) {
    double sum = 0;
    for (const CutOrgan::FacePart& part : parts) {
      const Eigen::Vector2d one = part.at[1] - part.at[0], other = part.at[2] - part.at[0];
      sum += one.x() * other.y() - one.y() * other.x();
      const auto& [a, b, c] = organ_.uncut_skin().faces[face];
      const auto& at = organ_.uncut_skin().vertices;
      for (int k = 0; k < 3; ++k) {
        const Vector3d there =
            (1 - part.at[k].sum()) * at[a] + part.at[k].x() * at[b] + part.at[k].y() * at[c];
        const std::uint32_t v = now.faces[part.face][k];
        EXPECT_LT((there - now.vertices[v]).norm(), 1e-9);
        // Relief ends at the lips, and nowhere else.
        EXPECT_EQ(part.limited(5, kCornersInFace[k]) == 0, organ_.now().skin->creased[v] != 0);
      }
    }
    EXPECT_NEAR(sum, 1, 1e-9);
  }
  // A lip ends within an edge of where the blade did.
  double first = 1e9, last = -1e9;
  for (std::size_t v = 0; v < now.vertices.size(); ++v) {
    if (!organ_.now().skin->creased[v]) continue;
    first = std::min(first, now.vertices[v].y()), last = std::max(last, now.vertices[v].y());
  }
  EXPECT_LT(first, -12 + 2.5);
  EXPECT_GT(last, 12 - 2.5);
}

TEST_F(CutOrganTest, ACutThatEndsWithinLeavesOneBody) {
  EXPECT_GT(draw_blade({3.3, -25, 0}, {3.3, 5, 0}, 30), 0u);
  EXPECT_EQ(organ_.body().cut().fragment_count(), 1u);
  EXPECT_GT(organ_.now().proxy.faces.size(), box_organ().proxy.faces.size());
}

class LivingOrgan : public CutOrganTest {
 protected:
  LivingOrgan() : CutOrganTest(1, true) {}

  std::vector<BloodLine> blood_at(double step) const {
    std::vector<BloodLine> blood;
    organ_.bleeding().add_blood(organ_.now().proxy.vertices, step, kStep_s, blood);
    return blood;
  }
  static constexpr double kStep_s = 1.0 / 60;
};

double amount_of(const std::vector<BloodLine>& blood) {
  double sum = 0;
  for (const BloodLine& line : blood)
    sum += (line.to_mm - line.from_mm).norm() * (line.from_radius_mm + line.to_radius_mm);
  return sum;
}

// None as a blade passes; more and more for two seconds, and then as much; and of each cut since
// its own time. It runs down from the lower lip alone.
TEST_F(LivingOrgan, BleedsForTwoSecondsWhereABladePassed) {
  draw_blade({3.3, -25, 0}, {3.3, 5, 0}, 30);
  EXPECT_TRUE(blood_at(0).empty());
  double last = 0;
  for (const int step : {15, 30, 60, 90, 120}) {
    const double now = amount_of(blood_at(step));
    EXPECT_GT(now, 1.05 * last) << step;
    last = now;
  }
  EXPECT_EQ(blood_at(500), blood_at(120));
  double lowest = 3.3, highest = 3.3;
  for (const BloodLine& line : blood_at(120)) {
    lowest = std::min(lowest, line.to_mm.x()), highest = std::max(highest, line.to_mm.x());
    EXPECT_NEAR(line.outward.norm(), 1, 1e-9);
  }
  EXPECT_LT(lowest, 1.5);  // down is −x
  EXPECT_LT(highest, 3.5);
  sweeps_.set_step(120);
  draw_blade({-14.2, -25, 0}, {-14.2, 5, 0}, 30);
  EXPECT_NEAR(amount_of(blood_at(120)), last, 0.02 * last);
  EXPECT_GT(amount_of(blood_at(240)), 1.5 * last);
}

// Its lips are wet from the first, and no more.
TEST_F(CutOrganTest, ACastDoesNotBleed) {
  draw_blade({3.3, -25, 0}, {3.3, 5, 0}, 30);
  std::vector<BloodLine> at_once, later;
  organ_.bleeding().add_blood(organ_.now().proxy.vertices, 0, 1.0 / 60, at_once);
  organ_.bleeding().add_blood(organ_.now().proxy.vertices, 500, 1.0 / 60, later);
  EXPECT_FALSE(at_once.empty());
  EXPECT_EQ(at_once, later);
  for (const BloodLine& line : later) EXPECT_NEAR(line.to_mm.x(), 3.3, 0.1);
}

// From a hook on its way and for a second and a half more, on the skin at its edge; of a scalpel
// none.
TEST_F(LivingOrgan, AHookSmokes) {
  for (const double width_mm : {0.0, 1.5}) {
    for (std::size_t step = 0; step <= 30; ++step) {
      const Vector3d tip(3.3 - 8 * width_mm, -15 + double(step), 0);
      sweeps_.set_step(step);
      advance({0, {tip, tip + Vector3d(0, 0, 30)}, width_mm});
    }
    sweeps_.advance({}, organ_, {});
    std::vector<SmokePuff> smoke, later;
    add_smoke(sweeps_.sheet(), Vector3d::UnitX(), 30, kStep_s, smoke);
    add_smoke(sweeps_.sheet(), Vector3d::UnitX(), 30 + 90, kStep_s, later);
    EXPECT_EQ(smoke.empty(), width_mm == 0);
    EXPECT_TRUE(later.empty());
    const auto low = [](const SmokePuff& puff) { return puff.middle_mm.z() - puff.radius_mm; };
    for (const SmokePuff& puff : smoke) EXPECT_GT(low(puff), 17.5) << puff.middle_mm;
    // The youngest is where the hook is now.
    if (width_mm > 0) {
      EXPECT_NEAR(smoke.at(0).middle_mm.y(), 15, 1);
    }
  }
}

class SmallCutOrgan : public CutOrganTest {
 protected:
  SmallCutOrgan() : CutOrganTest(0.5) {}
};

TEST_F(SmallCutOrgan, TakesTwentyCuts) {
  for (int i = 0; i < 20; ++i) {
    const double x = -14 + 1.45 * i, y = i % 2 ? 15 : -15;
    draw_blade({x, -y, -5 + 0.5 * i}, {-x / 2, y, 1.5 - 0.5 * i}, 20, 2, std::size_t(i % 3));
  }
  const auto volumes = test::fragment_volumes(organ_.body().cut(), organ_.body().uncut());
  const double whole = test::volume_mm3(organ_.body().uncut());
  EXPECT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0), whole, 1e-6 * whole);
  for (const Vector3d& v : organ_.now().proxy.vertices) ASSERT_TRUE(v.allFinite());
  for (const EmbeddedVertex& v : organ_.now().mechanics.body->vertices) {
    ASSERT_NEAR(v.weights[0] + v.weights[1] + v.weights[2] + v.weights[3], 1, 1e-9);
    for (const double w : v.weights) ASSERT_LT(std::abs(w), 3);
  }
}

}  // namespace
}  // namespace organbake
