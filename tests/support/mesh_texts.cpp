// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/mesh_texts.h"

#include <cstdint>
#include <cstring>
#include <iterator>

#include "organbake/core/text.h"

namespace organbake {
namespace {

template <typename Number>
void append_big_endian(std::string& bytes, Number value) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  bytes.append(std::reverse_iterator(raw + sizeof(Number)), std::reverse_iterator(raw));
}

}  // namespace

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

std::string as_vtk(const TriangleMesh& mesh, const std::string& more) {
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
std::string as_glb(const TriangleMesh& mesh, const std::string& node) {
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

}  // namespace organbake
