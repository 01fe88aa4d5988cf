// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/mesh_files.h"

#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "support/files.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

std::string upper_case(std::string text) {
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  return text;
}

class MeshFiles : public ::testing::Test {
 protected:
  TriangleMesh read(const std::string& name, const std::string& bytes) {
    write_bytes(folder_.path() / name, bytes);
    return read_mesh(folder_.path() / name);
  }
  std::string error(ExitCode code, const std::string& name, const std::string& bytes) {
    return message_of(code, [&] { read(name, bytes); });
  }
  TemporaryFolder folder_;
  TriangleMesh truth_ = lumpy_mesh(30, 2);
};

TEST_F(MeshFiles, EveryFormatGivesTheSameClosedMesh) {
  write_ply(folder_.path() / "a.ply", truth_);
  const std::pair<const char*, std::string> files[] = {
      {"a.ply", read_bytes(folder_.path() / "a.ply")},
      {"a.obj", as_obj(truth_)},
      {"a.vtk", as_vtk(truth_)},
      {"b.vtk", as_binary_vtk(truth_)},
      {"a.vtp", as_vtp(truth_)},
      {"a.vtu", as_vtu(truth_.vertices, triangles_of(truth_), 5)},
      {"a.stl", as_binary_stl(truth_)},
      {"b.stl", as_ascii_stl(truth_)},
      {"A.STL", as_binary_stl(truth_)},
      {"capitals.stl", upper_case(as_ascii_stl(truth_))},
      {"mark.stl", "\xEF\xBB\xBF" + as_ascii_stl(truth_)},
      {"blank.stl", "\r\n" + as_ascii_stl(truth_)},
      {"more.stl", as_binary_stl(truth_) + std::string(2, '\0')},
      {"a.off", as_off(truth_)},
      {"a.glb", as_glb(truth_)}};
  for (const auto& [name, bytes] : files) {
    const TriangleMesh mesh = read(name, bytes);
    EXPECT_EQ(mesh.vertices.size(), truth_.vertices.size()) << name;
    EXPECT_EQ(mesh.faces.size(), truth_.faces.size()) << name;
    EXPECT_TRUE(analyse_topology(mesh).closed_manifold()) << name;
    constexpr double kSinglePrecision = 1e-6;
    EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), 1, kSinglePrecision) << name;
  }
}

TEST_F(MeshFiles, OfSolidCellsTheOutsideIsTheSurface) {
  // An organ of tetrahedra round its middle: what lies between two of them is no surface.
  std::vector<Eigen::Vector3d> points = truth_.vertices;
  points.push_back(Eigen::Vector3d::Zero());
  std::vector<std::vector<std::uint32_t>> solids = triangles_of(truth_);
  for (auto& cell : solids) cell.push_back(static_cast<std::uint32_t>(points.size() - 1));
  const TriangleMesh mesh = read("solid.vtu", as_vtu(points, solids, 10));
  EXPECT_EQ(mesh.faces.size(), truth_.faces.size());
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
  EXPECT_NEAR(std::abs(signed_volume(mesh)) / signed_volume(truth_), 1, 1e-6);

  std::vector<Eigen::Vector3d> corners = box_mesh({10, 20, 30}).vertices;
  const TriangleMesh box = read("box.vtu", as_vtu(corners, {{0, 1, 3, 2, 4, 5, 7, 6}}, 12));
  EXPECT_EQ(box.faces.size(), 12u);
  EXPECT_NEAR(signed_volume(box), 6000, 1e-6);
}

TEST_F(MeshFiles, AFileIsReadByWhatItIsAndItsNameIsQuestioned) {
  write_ply(folder_.path() / "a.ply", truth_);
  const std::pair<const char*, std::string> files[] = {
      {"legacy.vtp", as_vtk(truth_)},
      {"legacy.vtu", as_binary_vtk(truth_)},
      {"xml.vtk", as_vtp(truth_)},
      {"grid.vtp", as_vtu(truth_.vertices, triangles_of(truth_), 5)},
      {"polydata.vtu", "<?xml version=\"1.0\"?>\n" + as_vtp(truth_)},
      {"ply.stl", read_bytes(folder_.path() / "a.ply")},
      {"binary.gltf", as_glb(truth_)},
      {"glb.obj", as_glb(truth_)}};
  constexpr double kSinglePrecision = 1e-6;
  for (const auto& [name, bytes] : files) {
    write_bytes(folder_.path() / name, bytes);
    std::string said;
    const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
    const TriangleMesh mesh = read_mesh(folder_.path() / name, {}, context);
    EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), 1, kSinglePrecision) << name;
    if (name == std::string("binary.gltf"))
      EXPECT_EQ(said, "") << "either ending will do";
    else
      EXPECT_THAT(said, HasSubstr("by its content and read as that; name it .")) << name;
  }
  EXPECT_THAT(error(ExitCode::bad_data, "image.vtp",
                    "<VTKFile type=\"ImageData\" version=\"0.1\"><ImageData/></VTKFile>"),
              HasSubstr("\"ImageData\", which is no surface; PolyData and UnstructuredGrid"));
}

TEST_F(MeshFiles, OfALegacyGridTheOutsideIsTheSurface) {
  const std::string points =
      "# vtk DataFile Version 3.0\ntest\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n"
      "0 0 0 90 0 0 0 90 0 0 0 90 90 90 90\n";
  const std::string counted = "CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n",
                    apart =
                        "CELLS 3 8\nOFFSETS vtktypeint64\n0 4 8\nCONNECTIVITY vtktypeint64\n"
                        "0 1 2 3 2 1 3 4\nCELL_TYPES 2\n10 10\n";
  for (const std::string& cells : {counted, apart}) {
    const TriangleMesh mesh = read("grid.vtk", points + cells);
    EXPECT_EQ(mesh.faces.size(), 6u) << "the face between the two is none";
    EXPECT_NEAR(std::abs(signed_volume(mesh)), 90 * 90 * 90 * 0.5, 1e-6);
  }
  EXPECT_THAT(error(ExitCode::bad_data, "cut.vtk",
                    points + "CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 1\n10\n"),
              HasSubstr("2 cells and 1 of their types"));
}

TEST_F(MeshFiles, AVtuThatIsBrokenIsRefused) {
  std::vector<std::vector<std::uint32_t>> cells = triangles_of(truth_);
  cells[5][1] = 100000;
  EXPECT_THAT(error(ExitCode::bad_data, "bad.vtu", as_vtu(truth_.vertices, cells, 5)),
              HasSubstr("point 100000"));
  const std::string whole = as_vtu(truth_.vertices, triangles_of(truth_), 5);
  EXPECT_THAT(error(ExitCode::bad_data, "cut.vtu", whole.substr(0, whole.size() / 2)),
              HasSubstr("cut.vtu"));
  EXPECT_THAT(error(ExitCode::bad_data, "none.vtu", as_vtu(truth_.vertices, {}, 5)),
              HasSubstr("no triangles"));
}

TEST_F(MeshFiles, ASoupIsWeldedAndKeepsItsColours) {
  truth_.colors.assign(truth_.vertices.size(), {0.1f, 0.2f, 0.3f});
  write_ply(folder_.path() / "soup.ply", soup_of(truth_));
  std::string said;
  const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
  const TriangleMesh mesh = read_mesh(folder_.path() / "soup.ply", {}, context);
  EXPECT_EQ(mesh.vertices.size(), truth_.vertices.size());
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
  const std::size_t welded = 3 * truth_.faces.size() - truth_.vertices.size();
  EXPECT_THAT(said, HasSubstr(std::to_string(welded) + " vertices that coincide"));
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
  EXPECT_NEAR(mesh.colors[7].y(), 0.2f, 1e-6f);
}

TEST_F(MeshFiles, ASoupRoundedToSinglePrecisionIsWeldedWithinAStatedTolerance) {
  TriangleMesh soup = soup_of(truth_);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v)
    soup.vertices[v].x() += 1e-6 * double(v % 3);
  write_ply(folder_.path() / "soup.ply", soup);
  std::string said;
  const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
  const TriangleMesh mesh = read_mesh(folder_.path() / "soup.ply", {}, context);
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
  EXPECT_THAT(said, HasSubstr("within"));
}

TEST_F(MeshFiles, BodiesThatTouchStayApart) {
  const TriangleMesh one = tetrahedron_mesh();
  TriangleMesh two = one;
  for (const auto& v : one.vertices) two.vertices.push_back(v);
  for (const Face& f : one.faces) two.faces.push_back({f[0] + 4, f[1] + 4, f[2] + 4});
  EXPECT_EQ(read("two.obj", as_obj(two)).vertices.size(), 8u);
}

TEST_F(MeshFiles, SizesThatNoOrganHasAreQuestionedAndUnitsMendThem) {
  TriangleMesh metres = truth_;
  for (auto& v : metres.vertices) v /= 1000;
  write_bytes(folder_.path() / "m.obj", as_obj(metres));
  std::string said;
  const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
  read_mesh(folder_.path() / "m.obj", {}, context);
  EXPECT_THAT(said, HasSubstr("--unit m;"));
  said.clear();
  const TriangleMesh mesh = read_mesh(folder_.path() / "m.obj", {MeshUnit::m, {}}, context);
  EXPECT_EQ(said, "");
  EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), 1, 1e-12);
}

TEST_F(MeshFiles, WhatIsWoundInwardIsTurnedAndSaid) {
  std::string said;
  const RunContext context(
      [&](LogLevel level, std::string_view text) {
        if (level == LogLevel::warning) said += text;
      },
      {}, nullptr);
  const std::string inward[] = {as_obj(inside_out(truth_)), as_obj(mirrored(inside_out(truth_))),
                                as_obj(joined(moved(truth_, {100, 0, 0}), inside_out(truth_)))};
  for (const std::string& text : inward) {
    said.clear();
    write_bytes(folder_.path() / "a.obj", text);
    const TriangleMesh mesh = read_mesh(folder_.path() / "a.obj", {}, context);
    const double pieces = double(mesh.faces.size()) / double(truth_.faces.size());
    EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), pieces, 1e-9);
    EXPECT_THAT(said, HasSubstr("a.obj: 1 piece that was wound inside out turned outward"));
  }
}

TEST_F(MeshFiles, ANodesTransformIsTaken) {
  const TriangleMesh mesh =
      read("a.glb", as_glb(truth_, R"(,"translation":[0.5,0,0],"scale":[2,2,2])"));
  EXPECT_NEAR(bounds(mesh).center().x(), 2 * bounds(truth_).center().x() + 500, 1e-3);
  EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), 8, 1e-4);
}

TEST_F(MeshFiles, ObjOddities) {
  const std::string corners = "v 1000000.125 0 0\nv 1000001.125 0 0\nv 1000000.125 1 0\n";
  const TriangleMesh far = read("far.obj", corners + "usemtl\nf 1// 2// 3//\n");
  EXPECT_EQ(far.vertices[0].x(), 1000000.125);  // no step of single precision
  EXPECT_EQ(read("back.obj", corners + "f -3 -2 \\\n-1\n").faces[0], (Face{0, 1, 2}));
  const TriangleMesh colored =
      read("c.obj", "v 0 0 0 1 0 0\nv 9 0 0 0 1 0\nv 0 9 0 0 0 1\nf 1 2 3\n");
  ASSERT_EQ(colored.colors.size(), 3u);
  EXPECT_EQ(colored.colors[1], Eigen::Vector3f(0, 1, 0));
  EXPECT_THAT(error(ExitCode::bad_data, "a.obj", corners + "f 1 2 x\n"), HasSubstr("line 4"));
}

TEST_F(MeshFiles, PolygonsBecomeTriangles) {
  const TriangleMesh square = read("square.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  EXPECT_EQ(square.faces.size(), 2u);
  EXPECT_NEAR(surface_area(square), 1, 1e-12);
}

TEST_F(MeshFiles, PointColoursBecomeLinear) {
  const TriangleMesh mesh = tetrahedron_mesh();
  const TriangleMesh read_back =
      read("a.vtk", as_vtk(mesh,
                           "POINT_DATA 4\nCOLOR_SCALARS rgb 3\n1 0 0\n0 1 0\n0 0 1\n"
                           "0.5 0.5 0.5\n"));
  ASSERT_EQ(read_back.colors.size(), 4u);
  EXPECT_EQ(read_back.colors[0], Eigen::Vector3f(1, 0, 0));
  EXPECT_NEAR(read_back.colors[3].x(), 0.212, 0.005);  // sRGB 0.5
}

TEST_F(MeshFiles, MissingAndUnknownAreTold) {
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_mesh(folder_.path() / "gone.obj"); }),
              HasSubstr("gone.obj: does not exist"));
  message_of(ExitCode::no_input, [&] { read_mesh(folder_.path()); });
  EXPECT_THAT(error(ExitCode::usage, "mesh.fbx", "x"),
              HasSubstr("use .ply, .obj, .stl, .off, .vtk, .vtp, .vtu, .glb or .gltf"));
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.vtk", "a.vtp"}) {
    EXPECT_THAT(error(ExitCode::bad_data, name, ""), HasSubstr("empty")) << name;
    EXPECT_THAT(error(ExitCode::bad_data, name, "words, not a mesh\n"), HasSubstr(name));
  }
}

TEST_F(MeshFiles, BadIndicesAndNumbersAreRefused) {
  TriangleMesh bad = tetrahedron_mesh();
  bad.faces[2][1] = 77;
  EXPECT_THAT(error(ExitCode::bad_data, "a.obj", as_obj(bad)), HasSubstr("a.obj"));
  EXPECT_THAT(error(ExitCode::bad_data, "a.vtk", as_vtk(bad)), HasSubstr("a.vtk"));
  EXPECT_THAT(error(ExitCode::bad_data, "a.vtp", as_vtp(bad)), HasSubstr("a.vtp"));
  TriangleMesh nan = tetrahedron_mesh();
  nan.vertices[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error(ExitCode::bad_data, "a.stl", as_binary_stl(nan)), HasSubstr("not finite"));
}

TEST_F(MeshFiles, TruncatedFilesAreRefused) {
  for (const auto& [name, whole] :
       {std::pair{"a.stl", as_binary_stl(truth_)}, std::pair{"a.vtk", as_vtk(truth_)},
        std::pair{"b.vtk", as_binary_vtk(truth_)}, std::pair{"a.vtp", as_vtp(truth_)}}) {
    for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
      const auto length = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
      EXPECT_THAT(error(ExitCode::bad_data, name, whole.substr(0, length)), HasSubstr(name));
    }
  }
}

TEST_F(MeshFiles, OtherDataSetsAreRefused) {
  for (const char* strip : {"0", "1 2", "2 0 3"})
    EXPECT_THAT(error(ExitCode::bad_data, "a.vtk",
                      std::string("# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"
                                  "POINTS 4 float\n0 0 0 9 0 0 0 9 0 9 9 1\nTRIANGLE_STRIPS 2 ") +
                          std::to_string(5 + (std::strlen(strip) + 1) / 2) + "\n4 0 1 2 3\n" +
                          strip + "\n"),
                HasSubstr("triangle strip 1 has"));
  EXPECT_THAT(error(ExitCode::bad_data, "a.vtk",
                    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n"
                    "DIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n"),
              HasSubstr("a.vtk"));
}

TEST(MeshFilesRealData, LiverOpens) {
  const auto file = shared_data("mesh/liver/liver.vtk");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "REAL DATA MISSING: " << file;
  const TriangleMesh liver = read_mesh(file);
  const MeshTopology topology = analyse_topology(liver);
  EXPECT_EQ(topology.faces, 20000u);  // the data's README
  EXPECT_EQ(topology.boundary_edges, 0u);
  EXPECT_EQ(topology.euler_characteristic, 12);
  for (const char* name : {"gallbladder.vtk", "liver_tumours.vtk", "portal_vein.vtk"})
    EXPECT_GT(read_mesh(shared_data("mesh/liver") / name).faces.size(), 100u) << name;
}

}  // namespace
}  // namespace organbake
