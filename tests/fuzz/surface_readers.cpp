// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh_files.h"
#include "fuzz/readers.h"
#include "geometry/ply.h"
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
  return {as_obj(tetrahedron_mesh()),
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
  return {as_vtk(tetrahedron_mesh()), as_binary_vtk(tetrahedron_mesh()),
          as_vtk(tetrahedron_mesh(),
                 "POINT_DATA 4\nCOLOR_SCALARS rgb 3\n1 0 0 0 1 0 0 0 1 0.5 0.5 0.5\n"),
          "# vtk DataFile Version 2.0\nstrips\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
          "0 0 0 9 0 0 0 9 0 9 9 1\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\n"};
}

Seeds vtp_seeds() { return {as_vtp(tetrahedron_mesh())}; }

Seeds vtu_seeds() {
  const TriangleMesh mesh = tetrahedron_mesh();
  return {as_vtu(mesh.vertices, triangles_of(mesh), 5), as_vtu(mesh.vertices, {{0, 1, 2, 3}}, 10)};
}

Seeds glb_seeds() {
  return {as_glb(tetrahedron_mesh()),
          as_glb(tetrahedron_mesh(), R"(,"translation":[0.5,0,0],"scale":[2,2,2])")};
}

Seeds gltf_seeds() {
  // One triangle, its buffer inside the text.
  return {
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],"buffers":[{"uri":)"
      R"("data:application/octet-stream;base64,AAABAAIAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAA=",)"
      R"("byteLength":44}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":6},)"
      R"({"buffer":0,"byteOffset":8,"byteLength":36}],"accessors":[{"bufferView":0,"byteOffset":0,)"
      R"("componentType":5123,"count":3,"type":"SCALAR","max":[2],"min":[0]},{"bufferView":1,)"
      R"("byteOffset":0,"componentType":5126,"count":3,"type":"VEC3","max":[1,1,0],"min":[0,0,0]}]})"};
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
       6000},
      {"vtp", read_as<'v', 't', 'p'>, vtp_seeds, kXml, 1000},
      {"vtu", read_as<'v', 't', 'u'>, vtu_seeds, kXml, 1000},
      {"glb", read_as<'g', 'l', 'b'>, glb_seeds, kGltf, 1000},
      {"gltf", read_as<'g', 'l', 't', 'f'>, gltf_seeds, kGltf, 1000},
  };
}

}  // namespace organbake
