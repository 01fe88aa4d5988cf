// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh_files.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>

#include "core/temporary_folder.h"
#include "core/text.h"
#include "file_bytes.h"
#include "geometry/mesh_checks.h"
#include "geometry/ply.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

std::string as_obj(const TriangleMesh& mesh) {
  std::string text = "# made by a test\n";
  for (const auto& v : mesh.vertices) {
    text += "v " + to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()) + "\n";
  }
  for (const Face& f : mesh.faces) {
    text += "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " +
            std::to_string(f[2] + 1) + "\n";
  }
  return text;
}

std::string as_vtk(const TriangleMesh& mesh, const std::string& more = {}) {
  std::string text = "# vtk DataFile Version 3.0\ntest\nASCII\nDATASET POLYDATA\nPOINTS " +
                     std::to_string(mesh.vertices.size()) + " double\n";
  for (const auto& v : mesh.vertices) {
    text += to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()) + "\n";
  }
  text += "POLYGONS " + std::to_string(mesh.faces.size()) + " " +
          std::to_string(4 * mesh.faces.size()) + "\n";
  for (const Face& f : mesh.faces) {
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
            "\n";
  }
  return text + more;
}

template <typename Number>
void append_big_endian(std::string& bytes, Number value) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  bytes.append(std::reverse_iterator(raw + sizeof(Number)), std::reverse_iterator(raw));
}

// As VTK 9 writes it: version 5.1, big-endian, offsets and corners apart, a field and metadata.
std::string as_binary_vtk(const TriangleMesh& mesh) {
  const std::string points = std::to_string(mesh.vertices.size());
  std::string text =
      "# vtk DataFile Version 5.1\nvtk output\nBINARY\nDATASET POLYDATA\n"
      "FIELD FieldData 1\nTimeValue 1 1 double\n";
  append_big_endian(text, 2.5);
  text += "\nPOINTS " + points + " float\n";
  for (const auto& v : mesh.vertices) {
    for (int c = 0; c < 3; ++c) append_big_endian(text, static_cast<float>(v[c]));
  }
  text += "\nMETADATA\nINFORMATION 0\n\nPOLYGONS " + std::to_string(mesh.faces.size() + 1) + " " +
          std::to_string(3 * mesh.faces.size()) + "\nOFFSETS vtktypeint64\n";
  for (std::size_t f = 0; f <= mesh.faces.size(); ++f) {
    append_big_endian(text, static_cast<std::int64_t>(3 * f));
  }
  text += "\nCONNECTIVITY vtktypeint64\n";
  for (const Face& f : mesh.faces) {
    for (const std::uint32_t v : f) append_big_endian(text, static_cast<std::int64_t>(v));
  }
  return text + "\nPOINT_DATA " + points + "\nNORMALS n float\n";
}

std::string as_binary_stl(const TriangleMesh& mesh) {
  std::string bytes(80, ' ');
  const auto append = [&](const void* data, std::size_t count) {
    bytes.append(static_cast<const char*>(data), count);
  };
  const auto count = static_cast<std::uint32_t>(mesh.faces.size());
  append(&count, 4);
  for (const Face& f : mesh.faces) {
    float values[12] = {};
    for (int c = 0; c < 3; ++c) {
      for (int i = 0; i < 3; ++i)
        values[3 + 3 * c + i] = static_cast<float>(mesh.vertices[f[c]][i]);
    }
    append(values, sizeof(values));
    bytes += std::string(2, '\0');
  }
  return bytes;
}

std::string as_ascii_stl(const TriangleMesh& mesh) {
  std::string text = "solid test\n";
  for (const Face& f : mesh.faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : f) {
      const Eigen::Vector3d& p = mesh.vertices[v];
      text += "vertex " + to_text(p.x()) + " " + to_text(p.y()) + " " + to_text(p.z()) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid test\n";
}

std::string as_vtp(const TriangleMesh& mesh) {
  std::string points, corners, ends;
  for (const auto& v : mesh.vertices) {
    points += to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()) + " ";
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::uint32_t v : mesh.faces[f]) corners += std::to_string(v) + " ";
    ends += std::to_string(3 * f + 3) + " ";
  }
  return "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"><PolyData>"
         "<Piece NumberOfPoints=\"" +
         std::to_string(mesh.vertices.size()) + "\" NumberOfPolys=\"" +
         std::to_string(mesh.faces.size()) +
         "\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" +
         points +
         "</DataArray></Points><Polys><DataArray type=\"Int64\" Name=\"connectivity\" "
         "format=\"ascii\">" +
         corners +
         "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" "
         "format=\"ascii\">" +
         ends + "</DataArray></Polys></Piece></PolyData></VTKFile>\n";
}

// An unstructured grid of cells of one kind: 5 triangles, 9 quads, 10 tetrahedra, 12 hexahedra.
std::string as_vtu(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<std::vector<std::uint32_t>>& cells, int kind) {
  std::string places, corners, ends, kinds;
  for (const auto& v : points)
    places += to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()) + " ";
  std::size_t end = 0;
  for (const auto& cell : cells) {
    for (const std::uint32_t v : cell) corners += std::to_string(v) + " ";
    ends += std::to_string(end += cell.size()) + " ";
    kinds += std::to_string(kind) + " ";
  }
  const auto array = [](const char* type, const char* more, const std::string& text) {
    return "<DataArray type=\"" + std::string(type) + "\" " + more + " format=\"ascii\">" + text +
           "</DataArray>";
  };
  return "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">"
         "<UnstructuredGrid><Piece NumberOfPoints=\"" +
         std::to_string(points.size()) + "\" NumberOfCells=\"" + std::to_string(cells.size()) +
         "\"><Points>" + array("Float64", "NumberOfComponents=\"3\"", places) + "</Points><Cells>" +
         array("Int64", "Name=\"connectivity\"", corners) +
         array("Int64", "Name=\"offsets\"", ends) + array("UInt8", "Name=\"types\"", kinds) +
         "</Cells></Piece></UnstructuredGrid></VTKFile>\n";
}

std::vector<std::vector<std::uint32_t>> triangles_of(const TriangleMesh& mesh) {
  std::vector<std::vector<std::uint32_t>> cells;
  for (const Face& f : mesh.faces) cells.push_back({f[0], f[1], f[2]});
  return cells;
}

std::string upper_case(std::string text) {
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  return text;
}

std::string as_off(const TriangleMesh& mesh) {
  std::string text = "OFF\n# made by a test\n" + std::to_string(mesh.vertices.size()) + " " +
                     std::to_string(mesh.faces.size()) + " 0\n";
  for (const auto& v : mesh.vertices)
    text += to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()) + "\n";
  for (const Face& f : mesh.faces)
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
            "\n";
  return text;
}

// Binary glTF in metres; `node` is more of the only node's JSON.
std::string as_glb(const TriangleMesh& mesh, const std::string& node = {}) {
  std::string data;
  const auto append = [&](std::string& to, auto value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  Bounds box = bounds(mesh);
  for (const auto& v : mesh.vertices)
    for (int c = 0; c < 3; ++c) append(data, static_cast<float>(v[c] / 1000));
  const std::size_t places = data.size();
  for (const Face& f : mesh.faces)
    for (const std::uint32_t v : f) append(data, v);
  const auto list = [](const Eigen::Vector3d& v) {
    return "[" + to_text(v.x() / 1000) + "," + to_text(v.y() / 1000) + "," + to_text(v.z() / 1000) +
           "]";
  };
  const std::string indices = std::to_string(3 * mesh.faces.size());
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)" + node +
      R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)" +
      std::to_string(data.size()) +
      R"(}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + std::to_string(places) +
      R"(},{"buffer":0,"byteOffset":)" + std::to_string(places) + R"(,"byteLength":)" +
      std::to_string(data.size() - places) +
      R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
      std::to_string(mesh.vertices.size()) + R"(,"min":)" + list(box.min) + R"(,"max":)" +
      list(box.max) + R"(},{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" +
      indices + "}]}";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  data.resize((data.size() + 3) / 4 * 4, '\0');
  std::string bytes = "glTF";
  append(bytes, std::uint32_t{2});
  append(bytes, static_cast<std::uint32_t>(28 + json.size() + data.size()));
  append(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  append(bytes, static_cast<std::uint32_t>(data.size()));
  bytes += std::string("BIN\0", 4) + data;
  return bytes;
}

TriangleMesh as_soup(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const Face& f : mesh.faces) {
    const auto at = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : f) {
      soup.vertices.push_back(mesh.vertices[v]);
      if (!mesh.colors.empty()) soup.colors.push_back(mesh.colors[v]);
    }
    soup.faces.push_back({at, at + 1, at + 2});
  }
  return soup;
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
  write_ply(folder_.path() / "soup.ply", as_soup(truth_));
  std::string said;
  const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
  const TriangleMesh mesh = read_mesh(folder_.path() / "soup.ply", MeshUnit::mm, context);
  EXPECT_EQ(mesh.vertices.size(), truth_.vertices.size());
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
  const std::size_t welded = 3 * truth_.faces.size() - truth_.vertices.size();
  EXPECT_THAT(said, HasSubstr(std::to_string(welded) + " vertices that coincide"));
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
  EXPECT_NEAR(mesh.colors[7].y(), 0.2f, 1e-6f);
}

TEST_F(MeshFiles, ASoupRoundedToSinglePrecisionIsWeldedWithinAStatedTolerance) {
  TriangleMesh soup = as_soup(truth_);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v)
    soup.vertices[v].x() += 1e-6 * double(v % 3);
  write_ply(folder_.path() / "soup.ply", soup);
  std::string said;
  const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
  const TriangleMesh mesh = read_mesh(folder_.path() / "soup.ply", MeshUnit::mm, context);
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
  read_mesh(folder_.path() / "m.obj", MeshUnit::mm, context);
  EXPECT_THAT(said, HasSubstr("--unit m,"));
  said.clear();
  const TriangleMesh mesh = read_mesh(folder_.path() / "m.obj", MeshUnit::m, context);
  EXPECT_EQ(said, "");
  EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), 1, 1e-12);
  // Our own files are in mm, whatever the unit of others is.
  write_ply(folder_.path() / "ours.ply", truth_);
  EXPECT_EQ(read_mesh(folder_.path() / "ours.ply", MeshUnit::m).vertices, truth_.vertices);
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
  for (const char* name : {"gallbladder.vtk", "liver_tumours.vtk", "portal_vein.vtk"}) {
    EXPECT_GT(read_mesh(shared_data("mesh/liver") / name).faces.size(), 100u) << name;
  }
}

}  // namespace
}  // namespace organbake
