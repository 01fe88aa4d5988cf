// SPDX-License-Identifier: GPL-3.0-or-later

#include "light/relit_skin.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/warper.h"
#include "samples/samples.h"
#include "support/organs.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// A flat square of 20 mm in two faces and, along its diagonal, a sliver of 0.02 mm between them.
TriangleMesh square_with_sliver() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}, {10.014, 9.986, 0}};
  mesh.faces = {{0, 1, 4}, {1, 2, 4}, {0, 4, 2}, {0, 2, 3}};
  return mesh;
}

BaseLayer layer_of(const TriangleMesh& proxy, double noise_mm) {
  BaseLayer layer;
  layer.steps = 10;
  layer.face_count = static_cast<std::uint32_t>(proxy.faces.size());
  RandomStream random(1);
  for (std::size_t i = 0; i < layer.face_count * std::size_t(layer.nodes_per_face()); ++i)
    layer.height_mm.push_back(static_cast<float>(random.uniform(-noise_mm, noise_mm)));
  return layer;
}

TEST(LatticeNormals, AreThoseOfAFlatFace) {
  const TriangleMesh proxy = square_with_sliver();
  for (const Vector3d& normal : lattice_normals(layer_of(proxy, 0), proxy))
    EXPECT_LT((normal - Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(LatticeNormals, ASliverTakesThoseOfItsRim) {
  const TriangleMesh proxy = square_with_sliver();
  constexpr double kNoise_mm = 0.005;  // of what a sliver's own triangles are high
  for (const Vector3d& normal : lattice_normals(layer_of(proxy, kNoise_mm), proxy))
    EXPECT_GT(normal.z(), 0.99);  // the sliver's own: down to 0.57
}

TEST(LatticeNormals, AreOneWhereFacesMeet) {
  const TriangleMesh proxy = square_with_sliver();
  const BaseLayer layer = layer_of(proxy, 0.3);
  const std::vector<Vector3d> normals = lattice_normals(layer, proxy);
  const auto at = [&](std::uint32_t face, std::uint32_t i, std::uint32_t j) {
    return normals[std::size_t(face) * layer.nodes_per_face() + base_node_index(layer.steps, i, j)];
  };
  for (std::uint32_t k = 0; k <= layer.steps; ++k) {
    EXPECT_EQ(at(2, 0, k), at(3, k, 0));                // edge 0–2
    EXPECT_EQ(at(0, 0, k), at(2, k, 0));                // edge 0–4
    EXPECT_EQ(at(0, layer.steps - k, k), at(1, 0, k));  // edge 1–4
  }
}

// A face cut from its first corner to the middle of the edge across, and a wall: the parts keep the
// normals that their material had, whatever the lips' relief says now; the wall has its own.
TEST(LatticeNormals, OfCutSkinAreThoseOfTheWhole) {
  TriangleMesh whole;
  whole.vertices = {{0, 0, 0}, {20, 0, 0}, {0, 20, 0}, {20, 20, 5}};
  whole.faces = {{0, 1, 2}, {1, 3, 2}};
  std::vector<Eigen::Vector3f> uncut;
  for (const Vector3d& normal : lattice_normals(layer_of(whole, 0.3), whole))
    uncut.push_back(normal.cast<float>());

  const Eigen::Vector2d first(0, 0), second(1, 0), third(0, 1), middle(0.5, 0.5);
  const CutOrgan::FaceParts parts = {
      {0, {{0, {first, second, middle}, {}}, {2, {first, middle, third}, {}}}}};
  TriangleMesh cut = whole;
  cut.vertices.insert(cut.vertices.end(), {{10, 10, 0}, {10, 10, 0}, {0, 0, -9}});
  cut.faces = {{0, 1, 4}, {1, 3, 2}, {0, 5, 2}, {0, 4, 6}};
  const BaseLayer layer = layer_of(cut, 2);
  const std::uint32_t n = layer.steps, nodes = layer.nodes_per_face();
  const std::vector<Vector3d> kept = cut_normals(uncut, parts, cut, n);

  for (std::uint32_t k = 0; k < nodes; ++k) {
    EXPECT_EQ(kept[nodes + k], uncut[nodes + k].cast<double>());           // not cut
    EXPECT_LT((kept[3 * nodes + k] - face_normal(cut, 3)).norm(), 1e-12);  // the wall
  }
  // Even nodes of the parts' edges lie on nodes of the whole.
  for (std::uint32_t k = 0; k <= n; k += 2) {
    const Vector3d lip = uncut[base_node_index(n, k / 2, k / 2)].cast<double>();
    EXPECT_LT((kept[base_node_index(n, 0, k)] - lip).norm(), 1e-6);
    EXPECT_LT((kept[2 * nodes + base_node_index(n, k, 0)] - lip).norm(), 1e-6);
    const Vector3d edge = uncut[base_node_index(n, k, 0)].cast<double>();
    EXPECT_LT((kept[base_node_index(n, k, 0)] - edge).norm(), 1e-6);
  }
}

using Eigen::Matrix3d;

TriangleMesh ball() { return SyntheticOrgan{}.mesh(2); }

// The mesh with a vertex in its first face, so near the face's first edge that it makes a sliver
// there, the last face.
TriangleMesh with_sliver(TriangleMesh mesh) {
  const Face face = mesh.faces[0];
  const auto near_edge = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.495 * (mesh.vertices[face[0]] + mesh.vertices[face[1]]) +
                             0.01 * mesh.vertices[face[2]]);
  mesh.faces[0] = {near_edge, face[1], face[2]};
  mesh.faces.push_back({face[0], near_edge, face[2]});
  mesh.faces.push_back({face[0], face[1], near_edge});
  return mesh;
}

void place(NormalTransport& turns, const TriangleMesh& posed, std::vector<std::uint8_t>& turned) {
  turns.place(shell_matrices(posed), std::vector<std::uint8_t>(posed.faces.size(), 1), turned);
}

constexpr double kFloatRounding = 1e-6;  // of entries about 1, a few products and sums

Matrix3d turn_at(const NormalTransport& turns, std::uint32_t face, double b1, double b2) {
  return turns.at(turns.on(face), float(b1), float(b2)).topRows<3>().cast<double>();
}

// Of a vertex whose faces are all folded or without area no gradient is known: it turns with what
// lies about it.
TEST(NormalTransport, AKnotBetweenCollapsedFacesTurnsWithTheOthers) {
  const Matrix3d turn = Eigen::AngleAxisd(1.2, Vector3d(1, 2, -1).normalized()).matrix();
  TriangleMesh proxy = ball();
  const Face face = proxy.faces[0];
  const auto middle = static_cast<std::uint32_t>(proxy.vertices.size());
  proxy.vertices.push_back(proxy.vertices[face[0]]);  // upon a corner
  proxy.faces[0] = {middle, face[1], face[2]};
  proxy.faces.push_back({face[0], middle, face[2]});
  proxy.faces.push_back({face[0], face[1], middle});
  NormalTransport turns{ShellSurface(proxy)};
  for (Vector3d& v : proxy.vertices) v = turn * v;
  std::vector<std::uint8_t> turned(proxy.faces.size());
  place(turns, proxy, turned);
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    for (const auto& [b1, b2] : {std::pair(0.0, 0.0), {0.5, 0.0}, {0.5, 0.5}, {0.3, 0.3}})
      EXPECT_LT((turn_at(turns, f, b1, b2) - turn).norm(), kFloatRounding) << "face " << f;
  }
}

TEST(NormalTransport, OnlyFacesNearWhatMovedAreTurnedAndComeBackToTheBit) {
  const TriangleMesh rest = ball();
  TriangleMesh pushed = rest;
  pushed.vertices[0] *= 0.9;
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, pushed, turned);
  const auto count = std::count(turned.begin(), turned.end(), 1);
  EXPECT_GE(count, 5);
  EXPECT_LT(count, static_cast<std::ptrdiff_t>(rest.faces.size()) / 2);
  for (std::uint32_t f = 0; f < turned.size(); ++f) EXPECT_EQ(turns.at_rest(f), !turned[f]);
  place(turns, rest, turned);
  for (std::uint32_t f = 0; f < turned.size(); ++f) EXPECT_TRUE(turns.at_rest(f));
}

// By the angle at the crest over a face's length; a ball's own curve is none.
TEST(NormalTransport, TellsHowSharplyAFoldBendsTheSkin) {
  const TriangleMesh rest = ball();
  TriangleMesh folded = rest;
  const Vector3d middle = SyntheticOrgan{}.center;
  for (Vector3d& v : folded.vertices) v.z() -= 2 * std::abs(v.x() - middle.x());
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, folded, turned);
  double on_crest = 0, beside = 0;
  int vertices_beside = 0;
  const double edge = std::sqrt(2 * surface_area(rest) / double(rest.faces.size()));
  for (std::uint32_t f = 0; f < rest.faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d at = rest.vertices[rest.faces[f][k]] - middle;
      const double bend = turns.at(turns.on(f), k == 1, k == 2)(3, 0);
      EXPECT_GE(bend, 0);
      if (at.z() < 0.7 * at.norm()) continue;
      if (std::abs(at.x()) < 0.3 * edge) on_crest = std::max(on_crest, bend);
      if (std::abs(at.x()) <= 1.3 * edge) continue;
      beside = std::max(beside, bend);
      ++vertices_beside;
    }
  }
  EXPECT_GT(on_crest, 0.5 / edge);
  EXPECT_LT(on_crest, 2 / edge);
  EXPECT_GT(vertices_beside, 0);
  EXPECT_LT(beside, 0.5 * on_crest);
}

TEST(NormalTransport, NormalsAreContinuousOverEdges) {
  const TriangleMesh rest = ball();
  TriangleMesh bent = rest;
  for (Vector3d& v : bent.vertices) v += Vector3d(0, 4 * std::sin(v.x() / 9), 3 * std::cos(v.y()));
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, bent, turned);
  const auto along = [&](std::uint32_t f, std::uint32_t a, std::uint32_t b, double share) {
    std::array<double, 3> at{};
    for (int k = 0; k < 3; ++k) {
      if (rest.faces[f][k] == a) at[k] = 1 - share;
      if (rest.faces[f][k] == b) at[k] = share;
    }
    return turn_at(turns, f, at[1], at[2]);
  };
  int shared = 0;
  for (std::uint32_t f = 0; f < rest.faces.size(); ++f) {
    for (std::uint32_t g = 0; g < f; ++g) {
      std::vector<std::uint32_t> common;
      for (const std::uint32_t v : rest.faces[f]) {
        if (std::count(rest.faces[g].begin(), rest.faces[g].end(), v)) common.push_back(v);
      }
      if (common.size() != 2) continue;
      ++shared;
      for (const double share : {0.0, 0.3, 0.5, 1.0}) {
        EXPECT_LT(
            (along(f, common[0], common[1], share) - along(g, common[0], common[1], share)).norm(),
            kFloatRounding);
      }
    }
  }
  EXPECT_EQ(shared, static_cast<int>(rest.faces.size()) * 3 / 2);
}

// A sliver's own gradient turns by anything: its vertices lie on a line but for a hair's breadth.
TEST(NormalTransport, ASliverHardlyTurnsTheSkinAboutIt) {
  const TriangleMesh rest = with_sliver(ball());
  TriangleMesh moved = rest;
  const Vector3d outward = face_normal(rest, 0);
  moved.vertices.back() += 0.5 * outward;  // the sliver is 0.3 mm high
  ASSERT_LT(face_normal(moved, rest.faces.size() - 1).dot(outward), 0.6);
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, moved, turned);
  constexpr double kMostTurn = 0.1;  // rad; by angles it was 0.5
  const auto sliver = static_cast<std::uint32_t>(rest.faces.size() - 1);
  for (const std::uint32_t f : {0u, sliver - 1, sliver}) {
    for (const auto& [b1, b2] : {std::pair(0.0, 0.0), {0.5, 0.0}, {0.5, 0.5}, {0.3, 0.3}}) {
      const Vector3d normal = (turn_at(turns, f, b1, b2) * outward).normalized();
      EXPECT_LT(std::acos(normal.dot(outward)), kMostTurn) << "face " << f;
    }
  }
}

// Straight over the proxy's faces, but curved as a shell: its normals are those of its own faces.
SmoothSkin even_skin(const TriangleMesh& proxy, std::uint32_t steps) {
  const Lattice lattice(proxy, steps);
  std::vector<std::vector<std::pair<std::uint32_t, double>>> nodes(lattice.node_count());
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f)
    each_node(steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      auto& node = nodes[lattice.node(f, i, j)];
      node.clear();
      const std::array<std::uint32_t, 3> share = {steps - i - j, i, j};
      for (int k = 0; k < 3; ++k)
        if (share[k] > 0) node.emplace_back(proxy.faces[f][k], double(share[k]) / steps);
    });
  SmoothSkin skin;
  skin.steps = steps;
  skin.first = {0};
  for (const auto& node : nodes) {
    for (const auto& [vertex, weight] : node)
      skin.carrier.push_back(vertex), skin.weight.push_back(weight);
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  return skin;
}

// A point over a coarser organ's faces is bound to the whole one's, and its place there leads back.
TEST(CoarserOrgan, BindsWhatAPixelShowsToTheWholeSkin) {
  constexpr std::uint32_t kSteps = 3;
  constexpr double kRounding_mm = 0.02, kOnceRound = 0.05;  // one step of Newton's; of a face
  Bundle whole;
  whole.proxy = organ_to_play().proxy;
  whole.skin = even_skin(whole.proxy, kSteps);
  const CoarserOrgan coarser(whole, nullptr, 4, CoarseFaces::of_proxy);
  const std::vector<ShellMatrix> skin = shell_matrices(whole.shell().at_rest()),
                                 faces = shell_matrices(coarser.bundle().shell().at_rest());
  ASSERT_EQ(faces.size(), whole.proxy.faces.size());
  std::set<std::uint32_t> met;
  for (std::uint32_t face = 0; face < faces.size(); ++face)
    for (int i = 0; i < 36; ++i) {
      const float b1 = 0.03f + 0.155f * static_cast<float>(i % 6),
                  b2 = 0.03f + 0.155f * static_cast<float>(i / 6);
      if (b1 + b2 > 0.97f) continue;
      BoundPixel pixel{face, b1, b2, 0.3f};
      const Eigen::Vector3d shown = shell_point(faces[face], b1, b2, pixel.height_mm);
      coarser.bind_to_whole(pixel);
      met.insert(pixel.face);
      EXPECT_LT((shell_point(skin[pixel.face], pixel.b1, pixel.b2, pixel.height_mm) - shown).norm(),
                kRounding_mm);
      const BoundPixel back = on_drawn_skin(pixel, kSteps);
      EXPECT_EQ(back.face, face);
      EXPECT_NEAR(back.b1, b1, kOnceRound);
      EXPECT_NEAR(back.b2, b2, kOnceRound);
    }
  EXPECT_EQ(met.size(), skin.size());
}

// A skin that bends within a coarse face is not where the face's corners tell.
TEST(CoarserOrgan, FollowsTheSkinWhereItBendsByLessThanHalfAPixel) {
  constexpr double kShare = 0.3, kMoved_mm = 5;
  Bundle whole;
  whole.proxy = organ_to_play().proxy;
  whole.skin = even_skin(whole.proxy, 3);
  // The middle of the first face follows a vertex far away, in place of one of its corners.
  const std::uint32_t middle = Lattice(whole.proxy, 3).node(0, 1, 1);
  const std::span carriers = std::span(whole.skin->carrier).subspan(whole.skin->first[middle], 3);
  std::uint32_t far = 0;
  while (std::ranges::find(carriers, far) != carriers.end()) ++far;
  whole.skin->carrier.insert(whole.skin->carrier.begin() + whole.skin->first[middle], far);
  whole.skin->weight.insert(whole.skin->weight.begin() + whole.skin->first[middle], kShare);
  whole.skin->weight[whole.skin->first[middle] + 1] -= kShare;
  for (std::size_t n = middle + 1; n < whole.skin->first.size(); ++n) ++whole.skin->first[n];
  const CoarserOrgan coarser(whole, nullptr, 4, CoarseFaces::of_proxy);
  const auto follows = [&](const std::vector<Eigen::Vector3d>& proxy, int side_px) {
    return coarser.follows(proxy, shell_matrices(coarser.bundle().shell().posed(proxy)),
                           view_from(organ_to_play(), {0.4, -1, 0.3}, side_px).camera);
  };
  std::vector<Eigen::Vector3d> proxy = whole.proxy.vertices;
  constexpr int kMany_px = 2000, kFew_px = 20;
  EXPECT_TRUE(follows(proxy, kMany_px));
  for (Eigen::Vector3d& vertex : proxy) vertex += Eigen::Vector3d(3, 2, 1);
  EXPECT_TRUE(follows(proxy, kMany_px));
  proxy[far].z() += kMoved_mm;
  EXPECT_FALSE(follows(proxy, kMany_px));
  EXPECT_TRUE(follows(proxy, kFew_px));
  const CoarserOrgan over_skin(whole, nullptr, 4, CoarseFaces::of_skin);
  EXPECT_EQ(over_skin.bundle().shell().posed(proxy).vertices, whole.shell().posed(proxy).vertices);
}

// Every `side`² pixels as one: their mean in linear light, or the middle one of them.
Rgb8Image shrunk(const Rgb8Image& image, int side, bool mean) {
  Rgb8Image small(image.width / side, image.height / side);
  for (int i = 0; i < small.width * small.height; ++i) {
    const int x = side * (i % small.width), y = side * (i / small.width);
    const auto at = [&](int right, int down) {
      return 3 * (std::size_t(y + down) * image.width + x + right);
    };
    for (int c = 0; c < 3; ++c) {
      float sum = 0;
      for (int k = 0; k < side * side; ++k)
        sum += linear_from_srgb8()[image.pixels[at(k % side, k / side) + c]];
      small.pixels[3 * std::size_t(i) + c] =
          mean ? srgb8_from_linear(sum / static_cast<float>(side * side))
               : image.pixels[at(side / 2, side / 2) + c];
    }
  }
  return small;
}

// Of a view whose pixels are as large as four texels a side: what sixteen of a picture four times
// as large mix to, and far nearer to it than any one of them, at rest and in a dent.
TEST(CoarserOrgan, ASmallPictureShowsTheMeanOfItsTexels) {
  constexpr int kSide_px = 32, kTexels = 4;
  constexpr double kGain_db = 3;
  const Bundle& bundle = organ_to_play();
  const Eigen::Vector3d from(0.4, -1, 0.3);
  const View view = view_from(bundle, from, kSide_px);
  std::vector<std::uint8_t> within(std::size_t(kSide_px) * kSide_px);  // no outline is near
  for (int i = 0; i < kSide_px * kSide_px; ++i)
    within[i] = std::hypot(i % kSide_px - kSide_px / 2, i / kSide_px - kSide_px / 2) < kSide_px / 5;
  for (const double depth_mm : {0.0, 12.0}) {
    const auto positions = dented(bundle.proxy, from, depth_mm);
    Warper warper(bundle), one_thread(bundle);
    Frame small, large, alone;
    const DrawReport coarse = warper.draw(positions, view, on_black(), small);
    const DrawReport fine =
        warper.draw(positions, view_from(bundle, from, kTexels * kSide_px), on_black(), large);
    EXPECT_NEAR(coarse.texel_mm / fine.texel_mm, kTexels, 0.2);
    EXPECT_LT(double(coarse.samples_drawn) * kTexels * kTexels, 1.3 * double(fine.samples_drawn));
    const Rgb8Image mean = shrunk(large.color, kTexels, true),
                    middle = shrunk(large.color, kTexels, false);
    EXPECT_GT(compare_images(small.color, mean, within).psnr_db,
              compare_images(middle, mean, within).psnr_db + kGain_db);
    const ThreadLimit limit(1);
    one_thread.draw(positions, view, on_black(), alone);
    EXPECT_EQ(alone.color.pixels, small.color.pixels);
  }
}

// Going away, where a view takes half as many texels a side as before.
TEST(CoarserOrgan, FewerTexelsAreNoJump) {
  constexpr double kStep = 1.002, kLargestMean = 0.005 * 255;
  Warper warper(organ_to_play());
  std::array<Frame, 2> frames;
  float texel_mm = 0;
  int halved = 0;
  for (double away = 1.6; away < 6; away *= kStep) {
    const View view = view_round(organ_to_play().cameras, 0.5, 0.3, away, 128, 128);
    std::swap(frames[0], frames[1]);
    const float now_mm =
        warper.draw(organ_to_play().proxy.vertices, view, on_black(), frames[1]).texel_mm;
    if (texel_mm > 0 && now_mm > 1.5f * texel_mm) {
      ++halved;
      double sum = 0;
      const auto &was = frames[0].color.pixels, &is = frames[1].color.pixels;
      for (std::size_t i = 0; i < is.size(); ++i) sum += std::abs(int(is[i]) - int(was[i]));
      EXPECT_LT(sum / double(is.size()), kLargestMean) << away;
    }
    texel_mm = now_mm;
  }
  EXPECT_EQ(halved, 2);
}

}  // namespace
}  // namespace organbake
