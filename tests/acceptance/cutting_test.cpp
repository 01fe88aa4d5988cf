// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/cutting/blade_sweeps.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/phantom.h"
#include "promises.h"
#include "support/files.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kStrokes = 4;  // into each body, before the next one is whole again
constexpr int kSkinFaces = 800;
// All are of this size, so that they are fast to check whole, and of coarse cells.
constexpr double kAcross_mm = 50, kCell_mm = 7;
constexpr double kRelief =
    0.15;  // from the darkest of a laparoscopy to its brightest, of its width

Bundle organ_of(const TriangleMesh& skin) {
  Bundle organ;
  organ.proxy = skin;
  organ.proxy.colors.clear();
  const Bounds box = bounds(skin);
  for (Vector3d& v : organ.proxy.vertices)
    v = kAcross_mm / (box.max - box.min).maxCoeff() * (v - box.center());
  MechanicsOptions options;
  options.fem = true;
  options.fem_cell_mm = kCell_mm;
  organ.mechanics = make_mechanics(organ.proxy, options);
  return organ;
}

TriangleMesh decimated(const TriangleMesh& mesh) {
  DecimateOptions options;
  options.method = DecimateMethod::quadric;
  options.faces = kSkinFaces;
  return decimate(largest_components(mesh, 1), options).proxy;
}

// A frame of a laparoscopy as a relief, brighter parts nearer.
TriangleMesh relief_of(const Rgb8Image& frame) {
  constexpr int kColumns = 36, kRows = 24;
  TriangleMesh sheet;
  for (int j = 0; j <= kRows; ++j) {
    for (int i = 0; i <= kColumns; ++i) {
      const std::uint8_t* pixel =
          frame.at(i * (frame.width - 1) / kColumns, j * (frame.height - 1) / kRows);
      const double bright = (pixel[0] + pixel[1] + pixel[2]) / 765.0;
      sheet.vertices.emplace_back(i, j, -kRelief * kColumns * bright);
      if (i == kColumns || j == kRows) continue;
      const auto a = static_cast<std::uint32_t>(j * (kColumns + 1) + i), b = a + kColumns + 1;
      sheet.faces.push_back({a, b, a + 1});
      sheet.faces.push_back({b, b + 1, a + 1});
    }
  }
  return sheet;
}

// Blades on their way through a body that lies bent: along its edges, through its nodes, grazing,
// in loops, there and back; some take tissue away. And needles.
class RandomBlades {
 public:
  RandomBlades(const CutOrgan& organ, std::uint64_t seed) : random_(seed) {
    const TetrahedralBody& body = organ.body().uncut();
    rest_ = body.nodes_mm;
    for (const Vector3d& n : rest_) low_ = low_.cwiseMin(n), high_ = high_.cwiseMax(n);
    bend_ = {random_.uniform(-1, 1), random_.uniform(-1, 1), random_.uniform(-1, 1)};
  }

  Vector3d bent(const Vector3d& at) const {
    const Vector3d share = (at - low_).cwiseQuotient(high_ - low_);
    return at + 0.05 * (high_ - low_).norm() * std::sin(3 * share.sum()) * bend_;
  }
  void draw(CutOrgan& organ, BladeSweeps& sweeps) {
    const std::uint64_t kind = random_.below(6);
    if (kind == 5) return pierce(organ, sweeps);
    const double width_mm = random_.below(3) == 0 ? random_.uniform(0.3, 4) : 0;
    const Vector3d from = place(kind == 0), to = kind == 4 ? from : place(kind == 0);
    Vector3d edge = place(kind == 1) - place(kind == 1);
    const int steps = 2 + static_cast<int>(random_.below(10));
    for (int i = 0; i <= steps; ++i) {
      const double share = double(i) / steps, turn = 6 * share;
      Vector3d tip = from + share * (to - from);
      if (kind == 3) tip = from + 12 * Vector3d(std::cos(turn), std::sin(turn), 0);
      if (kind == 4) edge = Eigen::AngleAxisd(0.3 * turn, Vector3d::UnitZ()) * edge;
      const CuttingStep now{0, {bent(tip), bent(tip) + edge}, width_mm};
      sweeps.advance({&now, 1}, organ, nodes_of(organ));
      if (i == steps / 2 && kind == 2) organ.part(sweeps.sheet());
    }
    sweeps.advance({}, organ, {});
    organ.part(sweeps.sheet());
  }

 private:
  std::vector<Vector3d> nodes_of(const CutOrgan& organ) const {
    const TetrahedralBody& body = organ.body().uncut();
    std::vector<Vector3d> nodes;
    for (std::uint32_t n = 0; n < organ.body().cut().node_count(); ++n)
      nodes.push_back(bent(body.nodes_mm[organ.body().cut().original(n)]));
    return nodes;
  }
  void pierce(CutOrgan& organ, BladeSweeps& sweeps) {
    const std::vector<Vector3d>& skin = organ.uncut_skin().vertices;
    const Vector3d at = bent(skin[random_.below(skin.size())]);
    const Vector3d up = (place(false) - place(false)).normalized();
    sweeps.pierce(at, up, random_.uniform(0.1, 1.5), organ, nodes_of(organ));
    organ.part(sweeps.sheet());
  }
  Vector3d place(bool node) {
    if (node) return rest_[random_.below(rest_.size())];
    const double x = random_.uniform(), y = random_.uniform(), z = random_.uniform();
    return low_ + Vector3d(x, y, z).cwiseProduct(high_ - low_);
  }

  RandomStream random_;
  std::vector<Vector3d> rest_;
  Vector3d low_ = Vector3d::Constant(1e300), high_ = Vector3d::Constant(-1e300);
  Vector3d bend_;
};

// What is wrong with an organ after its cuts; nothing when it is sound.
std::string fault_of(const CutOrgan& organ) {
  const TetrahedralBody& body = organ.body().uncut();
  double whole = 0;
  for (const Tetrahedron& t : body.tetrahedra) whole += volume_of(body, t);
  const auto volumes = test::fragment_volumes(organ.body().cut(), body);
  const double sum = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  if (!(std::abs(sum - whole) <= 1e-6 * whole)) return "the fragments' volumes are not the body's";
  if (!organ.cut()) return "";
  for (const Vector3d& v : organ.now().proxy.vertices)
    if (!v.allFinite()) return "a vertex is no number";
  for (const EmbeddedVertex& v : organ.now().mechanics.body->vertices)
    for (const double w : v.weights)
      if (!(std::abs(w) < 3)) return "a vertex hangs far from its tetrahedron";
  return "";
}

void sweep(const Bundle& organ) {
  const auto [first, sweeps] = asked_seeds(600, 33'336);
  const CutOrgan whole(organ);
  double wrong = 0;
  for (std::uint64_t done = 0; done < sweeps; done += kStrokes) {
    CutOrgan cut = whole;
    BladeSweeps blades(cut);
    RandomBlades random(cut, first + done);
    for (int stroke = 0; stroke < kStrokes; ++stroke) random.draw(cut, blades);
    const std::string fault = fault_of(cut);
    EXPECT_EQ(fault, "") << "case " << first + done;
    wrong += !fault.empty();
  }
  expect({std::to_string(sweeps) + " random sweeps of blades, " +
              std::to_string(organ.mechanics.body->tetrahedra.size()) +
              " tetrahedra: bodies with volumes, surfaces or places that are wrong",
          "", wrong, 0});
}

TEST(BladeSweeps, LeaveThePhantomSound) {
  sweep(organ_of(decimated(OrganPhantom{OrganPhantomOptions{}}.surface(5))));
}

TEST(BladeSweeps, LeaveALiverSound) {
  REQUIRE_SHARED_DATA("mesh/liver/liver.vtk");
  sweep(organ_of(decimated(read_mesh(shared_data("mesh/liver/liver.vtk")))));
}

TEST(BladeSweeps, LeaveALaparoscopysSheetSound) {
  REQUIRE_SHARED_DATA("photo/laparoscopy/liver_gallbladder_1080p.png");
  sweep(organ_of(
      relief_of(read_photo(shared_data("photo/laparoscopy/liver_gallbladder_1080p.png")))));
}

const Vector3d kBar_mm(80, 30, 30);
constexpr double kPull_n = 0.5;
constexpr int kSettled = 700;  // steps

// The bar's outside, quadrangles of `edge_mm` in two triangles each, about the origin.
TriangleMesh bar(double edge_mm) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const Eigen::Array3i count = (kBar_mm / edge_mm).array().round().cast<int>();
  const auto vertex = [&](const Eigen::Array3i& at) {
    const auto [found, made] = known.try_emplace({at.x(), at.y(), at.z()},
                                                 static_cast<std::uint32_t>(mesh.vertices.size()));
    if (made)
      mesh.vertices.push_back(
          (at.cast<double>() / count.cast<double>() - 0.5).matrix().cwiseProduct(kBar_mm));
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int one = (axis + 1) % 3, other = (axis + 2) % 3;
    for (const bool far : {false, true}) {
      for (int i = 0; i < count[one]; ++i) {
        for (int j = 0; j < count[other]; ++j) {
          const auto at = [&](int a, int b) {
            Eigen::Array3i place;
            place[axis] = far ? count[axis] : 0, place[one] = i + a, place[other] = j + b;
            return vertex(place);
          };
          const std::uint32_t p = at(0, 0), q = at(1, 0), r = at(1, 1), s = at(0, 1);
          const std::array<Face, 2> outward = {{{p, q, r}, {p, r, s}}};
          for (const auto& [a, b, c] : outward)
            mesh.faces.push_back(far ? Face{a, b, c} : Face{a, c, b});
        }
      }
    }
  }
  return mesh;
}

Bundle bar_of(double cell_mm) {
  Bundle organ;
  organ.manifest.name = "bar";
  organ.proxy = bar(2.5);
  MechanicsOptions options;
  options.fem = true;
  options.fem_cell_mm = cell_mm;
  organ.mechanics = make_mechanics(organ.proxy, options);
  // Held at one end.
  TetrahedralBody& body = *organ.mechanics.body;
  body.anchors.clear();
  for (std::uint32_t n = 0; n < body.nodes_mm.size(); ++n)
    if (body.nodes_mm[n].x() < 1 - kBar_mm.x() / 2) body.anchors.push_back(n);
  return organ;
}

// mm, of the lips half-way across, when the other end is pulled.
double opening_mm(double cell_mm) {
  CutOrgan organ(bar_of(cell_mm));
  BladeSweeps sweeps(organ);
  for (int i = 0; i <= 50; ++i) {
    const Vector3d tip(1.1, i - 25.0, 0);
    const CuttingStep now{0, {tip, tip + Vector3d(0, 0, 30)}};
    sweeps.advance(
        {&now, 1}, organ,
        organ.cut() ? organ.now().mechanics.body->nodes_mm : organ.body().uncut().nodes_mm);
    organ.part(sweeps.sheet());
  }
  const Bundle& cut = organ.now();
  const std::vector<Vector3d>& rest = cut.proxy.vertices;
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.tissue_contacts = false;
  Deformer deformer({{cut.proxy, cut.mechanics, cut.base, &*cut.skin}}, options);
  const auto at_end = [](const Vector3d& v) { return v.x() > kBar_mm.x() / 2 - 0.1; };
  const auto count = std::count_if(rest.begin(), rest.end(), at_end);
  std::vector<Vector3d> load(rest.size(), Vector3d::Zero());
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (at_end(rest[v])) load[v].x() = kPull_n / double(count);
  deformer.set_load(load);
  for (int i = 0; i < kSettled; ++i) deformer.step({});
  double widest = 0;
  for (std::size_t a = 0; a < rest.size(); ++a) {
    if (!cut.skin->creased[a] || rest[a].z() < kBar_mm.z() / 2 - 0.01 || std::abs(rest[a].y()) > 3)
      continue;
    for (std::size_t b = 0; b < a; ++b)
      if (cut.skin->creased[b] && (rest[a] - rest[b]).norm() < 1e-9)
        widest = std::max(widest, (deformer.positions()[a] - deformer.positions()[b]).norm());
  }
  return widest;
}

TEST(CutOpenings, OfCoarseCellsAreNearThoseOfFineOnes) {
  const double fine = opening_mm(2.5);
  // Coarse cells hold a cut's end together: the chapter on playing says so.
  for (const auto& [cell_mm, most_percent] : {std::pair(10.0, 30.0), {5.0, 15.0}}) {
    const double off = 100 * std::abs(opening_mm(cell_mm) / fine - 1);
    expect({"a bar cut half through, cells of " + to_text(cell_mm) +
                " mm: its opening from that of cells of 2.5 mm, " + to_text(fine, 2) + " mm",
            "%", off, most_percent});
  }
}

}  // namespace
}  // namespace organbake
