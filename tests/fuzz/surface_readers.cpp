// SPDX-License-Identifier: GPL-3.0-or-later
#include <vtkAppendFilter.h>
#include <vtkCellData.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkUnsignedShortArray.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include "fuzz/readers.h"
#include "fuzz/seeds.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/ply.h"
#include "support/mesh_texts.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// By the name's ending, as read_mesh() tells formats apart.
template <char... kEnding>
void read_as(std::span<const std::byte> bytes, const InputFolder& folder) {
  const char name[] = {'m', 'e', 's', 'h', '.', kEnding..., '\0'};
  read_mesh(folder.file(name, bytes));
}

TriangleMesh colored() {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.colors.assign(mesh.vertices.size(), {0.5f, 0.25f, 0.125f});
  return mesh;
}

std::string as_ascii_ply() {
  return "ply\nformat ascii 1.0\ncomment polygons and strips\nelement vertex 4\nproperty float x\n"
         "property float y\nproperty double z\nproperty uchar red\nproperty uchar green\n"
         "property uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n"
         "property uchar flag\nelement tristrips 1\nproperty list int int vertex_indices\n"
         "end_header\n0 0 0 255 0 0\n9 0 0 0 255 0\n0 9 0 0 0 255\n0 0 9 9 9 9\n3 0 2 1 0\n"
         "4 0 1 3 2 7\n6 0 1 2 -1 1 3\n";
}

std::string as_big_endian_ply() {
  std::string text =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\nproperty short y\n"
      "property short z\nelement face 1\nproperty list uchar ushort vertex_index\nend_header\n";
  for (const int number : {0, 0, 0, 9, 0, 0, 0, 9, 0}) text += {'\0', static_cast<char>(number)};
  return text + std::string("\3\0\0\0\1\0\2", 7);
}

Seeds ply_seeds() {
  return {serialise_ply(colored()), serialise_ply(tetrahedron_mesh()), as_ascii_ply(),
          as_big_endian_ply()};
}

Seeds obj_seeds() {
  return {"# SPACE=RAS UNIT=cm\n" + as_obj(tetrahedron_mesh()),
          "v 0 0 0 1 0 0\nv 9 0 0 0.5 0.5 0.5\nv 0 9 0 0 0 1\nv 0 0 9 1 1 1\nvt 0 0\nvn 0 0 1\n"
          "f 1/1/1 2/1/1 \\\n3/1/1\nf -4//1 -3//1 -1//1\nf 1 2 3 4\n"};
}

Seeds off_seeds() {
  return {as_off(tetrahedron_mesh()),
          "COFF\n3 1 0\n0 0 0 255 0 0 255\n9 0 0 0 1 0 1\n0 9 0 0 0 1 1\n3 0 1 2 0.1 0.2 0.3\n",
          "NOFF 4 1 0\n0 0 0 0 0 1\n9 0 0 0 0 1\n9 9 0 0 0 1\n0 9 0 0 0 1\n4 0 1 2 3\n"};
}

Seeds stl_seeds() { return {as_binary_stl(tetrahedron_mesh()), as_ascii_stl(tetrahedron_mesh())}; }

Seeds vtk_seeds() {
  return {as_vtk(tetrahedron_mesh()),
          as_binary_vtk(tetrahedron_mesh()),
          as_vtk(tetrahedron_mesh(),
                 "POINT_DATA 4\nCOLOR_SCALARS rgb 3\n1 0 0 0 1 0 0 0 1 0.5 0.5 0.5\n"),
          as_vtk(tetrahedron_mesh(),
                 "CELL_DATA 4\nFIELD f 1\ncolour 3 4 float\n1 0 0 0 1 0 0 0 1 0.5 0.5 0.5\n"),
          as_vtk(tetrahedron_mesh(),
                 "POINT_DATA 4\nVECTORS rgb unsigned_short\n9 0 0 0 9 0 0 0 9 6 6 6\n"),
          "# vtk DataFile Version 2.0\nstrips\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
          "0 0 0 9 0 0 0 9 0 9 9 1\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\n"};
}

// A square by a polygon and a strip, with a line and a point beside; colours of one or of the
// other.
vtkSmartPointer<vtkPolyData> square(bool colored_points) {
  const auto polydata = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  for (const double x : {0., 4., 9.})
    for (const double y : {0., 5.}) points->InsertNextPoint(x, y, x * y);
  polydata->SetPoints(points);
  polydata->AllocateExact(1, 4);
  const vtkIdType polygon[] = {0, 2, 3, 1}, strip[] = {2, 3, 4, 5};
  polydata->InsertNextCell(VTK_QUAD, 4, polygon);
  polydata->InsertNextCell(VTK_TRIANGLE_STRIP, 4, strip);
  polydata->InsertNextCell(VTK_LINE, 2, polygon);
  polydata->InsertNextCell(VTK_VERTEX, 1, polygon);
  vtkNew<vtkStringArray> space;
  space->SetName("SPACE");
  space->InsertNextValue("RAS");
  polydata->GetFieldData()->AddArray(space);
  const auto color = [](vtkDataArray* colors, vtkIdType count, vtkDataSetAttributes* data) {
    colors->SetName("RGB");
    colors->SetNumberOfComponents(3);
    colors->SetNumberOfTuples(count);
    for (vtkIdType i = 0; i < 3 * count; ++i)
      colors->SetComponent(i / 3, static_cast<int>(i % 3), 0.125 * double(i));
    data->AddArray(colors);
  };
  if (colored_points)
    color(vtkNew<vtkUnsignedShortArray>(), 6, polydata->GetPointData());
  else
    color(vtkNew<vtkFloatArray>(), 4, polydata->GetCellData());
  return polydata;
}

Seeds refused_vtks() {
  return {
      "# vtk DataFile Version 2.0\nshort strip\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n"
      "0 0 0 9 0 0\nTRIANGLE_STRIPS 1 3\n2 0 1\n"};
}

Seeds vtp_seeds() {
  Seeds seeds = {as_vtp(tetrahedron_mesh())};
  for (const bool colored_points : {true, false}) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetInputData(square(colored_points));
    append(vtk_writings(*writer), seeds);
  }
  return seeds;
}

Seeds refused_vtps() {
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(square(true));
  return {vtk_lz4_writing(*writer)};
}

Seeds vtu_seeds() {
  const TriangleMesh mesh = tetrahedron_mesh();
  Seeds seeds = {as_vtu(mesh.vertices, triangles_of(mesh), 5)};
  constexpr int kQuad = 9, kTetrahedron = 10;
  for (const int kind : {kQuad, kTetrahedron})
    seeds.push_back(as_vtu(mesh.vertices, {{0, 1, 2, 3}}, kind));
  vtkNew<vtkAppendFilter> grid;
  grid->AddInputData(square(true));
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetInputConnection(grid->GetOutputPort());
  append(vtk_writings(*writer), seeds);
  return seeds;
}

Seeds refused_vtus() {
  constexpr int kPolyhedron = 42, kNothing = 77;
  Seeds seeds;
  for (const int kind : {kPolyhedron, kNothing})
    seeds.push_back(as_vtu(tetrahedron_mesh().vertices, {{0, 1, 2, 3}}, kind));
  return seeds;
}

Seeds glb_seeds() {
  return {as_glb(tetrahedron_mesh()),
          as_glb(tetrahedron_mesh(), R"(,"translation":[0.5,0,0],"scale":[2,2,2])"),
          as_glb(tetrahedron_mesh(), R"(,"rotation":[0,0,0.6,0.8])"),
          as_glb(tetrahedron_mesh(), R"(,"matrix":[0,0,-9,0,0,9,0,0,9,0,0,0,1,2,3,1])")};
}

// Four corners with colours in a buffer inside the text, as `primitive` makes triangles of them;
// `more` may place them, or want what is not read.
std::string gltf_text(const std::string& primitive, const std::string& more) {
  return R"({"asset":{"version":"2.0"},)" + more +
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":1,"COLOR_0":2},)" + primitive +
         R"(}]}],"buffers":[{"uri":"data:application/octet-stream;base64,)"
         R"(AAABAAIAAwAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAAA)"
         R"(AIA/AACAPwAAgD//AAD/AP8A/wAA//+AgID/","byteLength":72}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":8},{"buffer":0,"byteOffset":8,)"
         R"("byteLength":48,"byteStride":12},{"buffer":0,"byteOffset":56,"byteLength":16}],)"
         R"("accessors":[{"bufferView":0,"componentType":5123,"count":4,"type":"SCALAR"},)"
         R"({"bufferView":1,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,)"
         R"("indices":{"bufferView":0,"componentType":5123},"values":{"bufferView":1}}},)"
         R"({"bufferView":2,"componentType":5121,"normalized":true,"count":4,"type":"VEC4"}]})";
}

const std::string kOneNode = R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)";

Seeds gltf_seeds() {
  const std::string tree = R"("nodes":[{"children":[1,2]},{"mesh":0,"scale":[1,-1,1]},{"mesh":0,)"
                           R"("translation":[3,0,0]}],"scenes":[{"nodes":[0]}],)";
  std::string skinned =
      gltf_text(R"("mode":4)", R"("nodes":[{"mesh":0,"skin":0},{"translation":[0,1,0]}],)"
                               R"("skins":[{"joints":[0,1]}],)");
  const std::string color = R"("COLOR_0":2)";
  skinned.replace(skinned.find(color), color.size(), R"("JOINTS_0":2,"WEIGHTS_0":2)");
  const std::string instances =
      R"("nodes":[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":)"
      R"({"TRANSLATION":1}},"KHR_node_visibility":{"visible":true}}}],)";
  return {skinned,
          gltf_text(R"("indices":0,"mode":5)", instances),
          gltf_text(R"("mode":4,"targets":[{"POSITION":1}])",
                    R"("nodes":[{"mesh":0,"weights":[0.5]}],"animations":[{}],)"),
          gltf_text(R"("indices":0,"mode":5)", kOneNode),
          gltf_text(R"("indices":0,"mode":6)", tree),
          gltf_text(R"("mode":4)", R"("extensionsRequired":["KHR_mesh_quantization"],)"
                                   R"("nodes":[{"children":[1]},{"mesh":0}],)")};
}

// Lines alone, a packing that is not read, a buffer that lies elsewhere.
Seeds refused_gltfs() {
  return {gltf_text(R"("indices":0,"mode":1)", kOneNode),
          gltf_text(R"("indices":0)",
                    R"("extensionsRequired":["EXT_meshopt_compression"],)" + kOneNode),
          R"({"asset":{"version":"2.0"},"buffers":[{"uri":"a%20b.bin","byteLength":4}]})",
          R"({"asset":{"version":"2.0"},"buffers":[{"uri":"../c.bin","byteLength":4}]})"};
}

const Words kXml = {"<VTKFile",
                    "type=\"",
                    "format=\"ascii\"",
                    "format=\"binary\"",
                    "format=\"appended\"",
                    "offset=\"",
                    "<AppendedData encoding=\"raw\">_",
                    "encoding=\"base64\"",
                    "NumberOfPoints=\"",
                    "NumberOfComponents=\"",
                    "Float32",
                    "Int64",
                    "UInt8",
                    "compressor=\"vtkZLibDataCompressor\"",
                    "header_type=\"UInt64\"",
                    "byte_order=\"BigEndian\"",
                    "<Piece",
                    "</Piece>",
                    "<PointData",
                    "<CellData",
                    "-1",
                    "99999999999"};
const Words kGltf = {"\"byteOffset\":",
                     "\"byteLength\":",
                     "\"byteStride\":",
                     "\"count\":",
                     "\"componentType\":",
                     "5120",
                     "5121",
                     "5123",
                     "5125",
                     "5126",
                     "\"SCALAR\"",
                     "\"VEC3\"",
                     "\"VEC4\"",
                     "\"COLOR_0\":",
                     "\"sparse\":",
                     "\"children\":[0]",
                     "\"mode\":5",
                     "\"skin\":0",
                     "\"joints\":[0]",
                     "\"targets\":[{\"POSITION\":1}]",
                     "\"weights\":[1]",
                     "\"EXT_mesh_gpu_instancing\":",
                     "\"uri\":",
                     "\"images\":",
                     "\"extensions\":",
                     "\"matrix\":[",
                     "\"animations\":[",
                     "-1",
                     "4294967295",
                     "[]",
                     "{}",
                     "null"};

}  // namespace

std::vector<FuzzReader> surface_readers() {
  return {
      {"ply",
       read_as<'p', 'l', 'y'>,
       ply_seeds,
       {"format ascii 1.0", "format binary_little_endian 1.0", "element vertex ", "element face ",
        "element tristrips ", "property list ", "property float ", "uchar ", "int ", "double ",
        "vertex_indices", "vertex_index", "red", "end_header\n", "comment ", "-1 ", "4294967295"},
       6000},
      {"obj",
       read_as<'o', 'b', 'j'>,
       obj_seeds,
       {"v ", "f ", "vt ", "vn ", "-1", "1/2/3", "//", "\\\n", "1e309", "nan", "0 "},
       6000},
      {"off",
       read_as<'o', 'f', 'f'>,
       off_seeds,
       {"OFF", "COFF", "NOFF", "STOFF", "4OFF", "nOFF", "BINARY", "# ", "-1 ", "4294967296 "},
       6000},
      {"stl",
       read_as<'s', 't', 'l'>,
       stl_seeds,
       {"solid ", "facet normal ", "outer loop\n", "vertex ", "endloop\n", "endfacet\n", "endsolid",
        "nan", "1e309"},
       6000},
      {"vtk",
       read_as<'v', 't', 'k'>,
       vtk_seeds,
       {"# vtk DataFile Version 5.1\n",
        "ASCII\n",
        "BINARY\n",
        "DATASET POLYDATA\n",
        "POINTS ",
        "POLYGONS ",
        "TRIANGLE_STRIPS ",
        "LINES ",
        "VERTICES ",
        "OFFSETS vtktypeint64\n",
        "CONNECTIVITY vtktypeint64\n",
        "POINT_DATA ",
        "CELL_DATA ",
        "COLOR_SCALARS ",
        "FIELD ",
        "METADATA\n",
        "float",
        "double",
        "-1 ",
        "18446744073709551615 "},
       6000,
       refused_vtks},
      {"vtp", read_as<'v', 't', 'p'>, vtp_seeds, kXml, 1000, refused_vtps},
      {"vtu", read_as<'v', 't', 'u'>, vtu_seeds, kXml, 1000, refused_vtus},
      {"glb", read_as<'g', 'l', 'b'>, glb_seeds, kGltf, 1000},
      {"gltf", read_as<'g', 'l', 't', 'f'>, gltf_seeds, kGltf, 1000, refused_gltfs},
  };
}

}  // namespace organbake
