// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/mesh_files.h"

#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataWriter.h>

#include <Eigen/LU>

#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/exchange/exports.h"
#include "organbake/geometry/ply.h"
#include "support/files.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

constexpr double kFrame_mm = 1e-3;  // what is asked of a round trip

Eigen::Vector3d middle(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Face& face = mesh.faces[f];
    const double own = face_area(mesh, f);
    sum += own / 3 * (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]);
    area += own;
  }
  return sum / area;
}

// An organ where organs lie, unlike its mirror images and turns.
TriangleMesh organ_in_place() { return moved(lumpy_mesh(60, 3), {13.7, -20, 308.75}); }

TriangleMesh written_in(TriangleMesh mesh, MeshUnit unit, MeshSpace space) {
  const Eigen::Matrix3d file_from_world = world_from_axes(space).transpose() / mm_per(unit);
  for (Eigen::Vector3d& v : mesh.vertices) v = file_from_world * v;
  return mesh;
}

std::string after(std::string text, const std::string& mark, const std::string& more) {
  return text.insert(text.find(mark) + mark.size(), more);
}

std::string with_binary_header(std::string stl, const std::string& header) {
  return stl.replace(0, header.size(), header);
}

std::string as_ascii_ply(const TriangleMesh& mesh, const std::string& comment) {
  std::string text = "ply\nformat ascii 1.0\ncomment VTK generated PLY File\ncomment " + comment +
                     "\nelement vertex " + std::to_string(mesh.vertices.size()) +
                     "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                     std::to_string(mesh.faces.size()) +
                     "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& v : mesh.vertices)
    text += to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()) + "\n";
  for (const Face& f : mesh.faces)
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
            "\n";
  return text;
}

class MeshFrames : public ::testing::Test {
 protected:
  TriangleMesh read(const std::string& name, const std::string& bytes, const MeshFrame& told = {}) {
    write_bytes(folder_.path() / name, bytes);
    const RunContext context([&](LogLevel, std::string_view text) { said_ += text; }, {}, nullptr);
    return read_mesh(folder_.path() / name, told, context);
  }
  void expect_in_place(const TriangleMesh& mesh, const std::string& what) {
    EXPECT_LT((middle(mesh) - middle(truth_)).norm(), kFrame_mm) << what;
    EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth_), 1, 1e-5) << what;
  }

  TemporaryFolder folder_;
  std::string said_;
  const TriangleMesh truth_ = organ_in_place();
};

TEST_F(MeshFrames, AxesAreProperTurns) {
  for (const SpaceName& known : kMeshSpaces) {
    const Eigen::Matrix3d turn = world_from_axes(known.space);
    EXPECT_TRUE((turn * turn.transpose()).isIdentity(0)) << known.name;
    EXPECT_EQ(turn.determinant(), 1) << known.name;
  }
  EXPECT_EQ(world_from_axes(MeshSpace::y_up) * scene_from_world({1000, 2000, 3000}),
            Eigen::Vector3d(1, 2, 3))
      << "the exports' own axes";
}

TEST_F(MeshFrames, WhatIsToldBringsEveryFormatIntoTheWorld) {
  for (const UnitName& unit : kMeshUnits)
    for (const SpaceName& space : kMeshSpaces) {
      const TriangleMesh written = written_in(truth_, unit.unit, space.space);
      const MeshFrame told{unit.unit, space.space};
      const std::string what = std::string(unit.name) + " " + space.name;
      TriangleMesh metres = written;  // as_glb() takes them for millimetres
      for (auto& v : metres.vertices) v *= 1000;
      for (const auto& [name, bytes] : {std::pair{"a.obj", as_obj(written)},
                                        {"a.off", as_off(written)},
                                        {"a.stl", as_binary_stl(written)},
                                        {"b.stl", as_ascii_stl(written)},
                                        {"a.vtk", as_vtk(written)},
                                        {"a.vtp", as_vtp(written)},
                                        {"a.glb", as_glb(metres)},
                                        {"a.ply", as_ascii_ply(written, "of a test")}})
        expect_in_place(read(name, bytes, told), what + " " + name);
    }
  EXPECT_EQ(said_.find("which no organ is"), said_.npos) << said_;
}

TEST_F(MeshFrames, AGltfFileThatSaysNothingIsInMetresWithYUp) {
  expect_in_place(read("a.glb", as_glb(written_in(truth_, MeshUnit::mm, MeshSpace::y_up))), "glb");
}

TEST_F(MeshFrames, SpacesInHeadersAreTaken) {
  for (const SpaceName& space : kMeshSpaces) {
    const std::string says = std::string("SPACE=") + space.letters;
    const TriangleMesh mesh = written_in(truth_, MeshUnit::mm, space.space);
    const std::string slicer = "3D Slicer output. " + says;
    expect_in_place(read("a.obj", "# " + slicer + "\n" + as_obj(mesh)), says + " obj");
    expect_in_place(read("a.ply", as_ascii_ply(mesh, says)), says + " ply");
    expect_in_place(read("a.stl", with_binary_header(as_binary_stl(mesh), slicer)), says + " stl");
    expect_in_place(read("b.stl", after(as_ascii_stl(mesh), "solid", " " + slicer)),
                    says + " text");
    for (const std::string& text : {as_vtk(mesh), as_binary_vtk(mesh)}) {
      const std::size_t title = text.find('\n') + 1, end = text.find('\n', title);
      expect_in_place(read("a.vtk", text.substr(0, title) + slicer + text.substr(end)),
                      says + " vtk");
    }
  }
}

TEST_F(MeshFrames, SpacesInFieldsOfVtkXmlAreTaken) {
  const TriangleMesh mesh = written_in(truth_, MeshUnit::mm, MeshSpace::ras);
  const std::string field =
      "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">\n"
      "82 65 83 0 \n</Array></FieldData>";
  expect_in_place(read("a.vtp", after(as_vtp(mesh), "<PolyData>", field)), "as text");

  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> cells;
  for (const auto& v : mesh.vertices) points->InsertNextPoint(v.data());
  for (const Face& f : mesh.faces) cells->InsertNextCell({f[0], f[1], f[2]});
  data->SetPoints(points);
  data->SetPolys(cells);
  vtkNew<vtkStringArray> space;
  space->SetName("SPACE");
  space->InsertNextValue("RAS");
  data->GetFieldData()->AddArray(space);
  for (const bool packed : {false, true}) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetInputData(data);
    writer->SetFileName((folder_.path() / "b.vtp").c_str());
    if (!packed) writer->SetCompressorTypeToNone();
    writer->SetDataModeToAppended();
    writer->Write();
    expect_in_place(read_mesh(folder_.path() / "b.vtp"), packed ? "packed" : "appended");
  }
}

TEST_F(MeshFrames, WhatAFileSaysOutranksWhatIsTold) {
  const TriangleMesh ras = written_in(truth_, MeshUnit::mm, MeshSpace::ras);
  expect_in_place(read("a.ply", as_ascii_ply(ras, "SPACE=RAS"), {{}, MeshSpace::lps}), "ply");
  EXPECT_THAT(said_, HasSubstr("says itself that it is in RAS"));
  said_.clear();
  expect_in_place(read("b.ply", serialise_ply(truth_), {MeshUnit::cm, MeshSpace::ras}), "our own");
  EXPECT_THAT(said_, HasSubstr("says itself that it is in mm"));
  const TriangleMesh cm = written_in(truth_, MeshUnit::cm, MeshSpace::lps);
  expect_in_place(read("a.obj", "# SPACE=LPS UNIT=cm\n" + as_obj(cm), {MeshUnit::m, {}}), "obj");
}

TEST_F(MeshFrames, WordsThatOnlyLookLikeASpaceAreNone) {
  const auto frame = [](const std::string& header) { return frame_in_header(header, "a.obj"); };
  EXPECT_FALSE(frame("# COLORSPACE=RAS").space);
  EXPECT_FALSE(frame("# SPACE=sRGB").space);
  EXPECT_FALSE(frame("# SPACE RAS, LPS").space);
  EXPECT_FALSE(frame("").space);
  EXPECT_EQ(frame("# space=ras").space, MeshSpace::ras);
  EXPECT_EQ(frame("COLOR=rgba,SPACE=LPS,UNIT=m").unit, MeshUnit::m);
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { frame("# SPACE=LAS"); }),
              HasSubstr("a.obj: its header says SPACE=LAS"));
}

// What export writes comes back where it was, and stays there when that is exported once more.
TEST_F(MeshFrames, ExportsComeBackWhereTheyWere) {
  TriangleMesh organ = truth_;
  for (int round = 0; round < 2; ++round) {
    TexturedMesh textured;
    textured.vertices = organ.vertices;
    textured.normals = vertex_normals(organ);
    for (const Face& face : organ.faces) {
      std::array<TexturedMesh::Corner, 3> corners;
      for (std::size_t c = 0; c < 3; ++c) {
        corners[c] = {face[c], static_cast<std::uint32_t>(textured.coordinates.size())};
        textured.coordinates.emplace_back(0.5, 0.5);
        textured.tangents.push_back(textured.normals[face[c]].unitOrthogonal());
      }
      textured.faces.push_back(corners);
    }
    textured.color = Rgb8Image(4, 4);
    textured.normal_map = Rgb8Image(4, 4);
    for (const MeshFrame& told : {MeshFrame{}, MeshFrame{MeshUnit::mm, MeshSpace::lps},
                                  MeshFrame{MeshUnit::cm, MeshSpace::ras}}) {
      const TriangleMesh glb = read("organ.glb", gltf_binary(textured, {}), told);
      expect_in_place(glb, "glb");
      EXPECT_EQ(glb.vertices.size(), truth_.vertices.size()) << "seams are welded";
      organ = read("organ.obj", obj_text(textured, "organ.mtl"), told);
      expect_in_place(organ, "obj");
    }
  }
}

TEST_F(MeshFrames, AdviceIsGivenThatWorks) {
  read("a.glb", as_glb(scaled(truth_, 1000)));
  EXPECT_THAT(said_, HasSubstr("--unit mm; of a table or recipe unit=mm"));
  said_.clear();
  const TriangleMesh mm =
      read("a.glb", as_glb(scaled(written_in(truth_, MeshUnit::mm, MeshSpace::y_up), 1000)),
           {MeshUnit::mm, {}});
  EXPECT_EQ(said_, "");
  expect_in_place(mm, "a glb of millimetres");
  read("a.obj", "# SPACE=LPS UNIT=mm\n" + as_obj(scaled(truth_, 1e-3)));
  EXPECT_THAT(said_, HasSubstr("it says itself that it is in mm"));
  EXPECT_EQ(said_.find("--unit"), said_.npos);
  said_.clear();
  read("ours.ply", serialise_ply(scaled(truth_, 1e-3)));
  EXPECT_EQ(said_, "") << "the stage that made it has said it";
}

// A liver of 20 units is one in centimetres, or the like of a lymph node in millimetres.
TEST_F(MeshFrames, SmallThingsAreQuestionedUntilTheirUnitIsTold) {
  const auto said_of = [&](double across, const MeshFrame& told) {
    said_.clear();
    read("a.obj", as_obj(scaled(sphere_mesh(0.5, 3), across)), told);
    return said_;
  };
  EXPECT_THAT(said_of(20, {}),
              HasSubstr("is 20.000 mm across, which few organs are; in centimetres "
                        "(--unit cm; of a table or recipe unit=cm; 10.000 times as "
                        "large) it would be 200.000 mm. If it is right, say --unit mm"));
  EXPECT_EQ(said_of(20, {MeshUnit::mm, {}}), "");
  EXPECT_EQ(said_of(40, {}), "");
  EXPECT_THAT(said_of(8, {}), HasSubstr("in centimetres"));
  EXPECT_THAT(said_of(2, {MeshUnit::mm, {}}), HasSubstr("which no organ is; in inches"));
}

// What a scope sees of an organ: everything of a ball that lies above a plane.
TriangleMesh cap_of_ball(double across, double above_share) {
  TriangleMesh ball = scaled(sphere_mesh(0.5, 4), across);
  std::erase_if(ball.faces, [&](const Face& face) {
    return std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
      return ball.vertices[v].z() < (above_share - 0.5) * across;
    });
  });
  return ball;
}

TEST_F(MeshFrames, APartOfASurfaceMayBeAsSmallAsItIs) {
  const auto said_of = [&](const TriangleMesh& mesh) {
    said_.clear();
    read("a.obj", as_obj(mesh));
    return said_;
  };
  for (const double across : {20.0, 23.5, 27.0}) {
    for (const double above : {0.9, 0.5, 0.2})
      EXPECT_EQ(said_of(cap_of_ball(across, above)).find("few organs"), std::string::npos)
          << across << " mm, without its lower " << above;
    EXPECT_THAT(said_of(cap_of_ball(across, 0.01)), HasSubstr("few organs are; in centimetres"))
        << "a hole makes no part of it";
  }
  EXPECT_THAT(said_of(cap_of_ball(0.02, 0.5)),
              HasSubstr("in metres (--unit m; of a table or recipe unit=m; 1000.000 times as "
                        "large) it would be 20.000 mm"));
}

TEST_F(MeshFrames, WhatNoUnitExplainsIsToldByWhichFactor) {
  const auto said_of = [&](double across) {
    said_.clear();
    read("a.obj", as_obj(scaled(sphere_mesh(0.5, 3), across)));
    return said_;
  };
  EXPECT_THAT(said_of(150e6), HasSubstr("scale it by about 0.000001")) << "nanometres";
  EXPECT_THAT(said_of(150e3), HasSubstr("scale it by about 0.001")) << "micrometres";
  EXPECT_THAT(said_of(140e-6), HasSubstr("is 0.0001 mm across")) << "kilometres";
  EXPECT_THAT(said_, HasSubstr("scale it by about 1000000.000"));
}

}  // namespace
}  // namespace organbake
