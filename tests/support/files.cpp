// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/files.h"

#include <zlib.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"

namespace organbake {

double ramp_hu(const Eigen::Vector3d& world_mm) {
  return 12 * world_mm.x() - 7 * world_mm.y() + 5 * world_mm.z() - 100;
}

Eigen::Matrix3d oblique_direction() {
  return (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

Volume ramp_volume(const Eigen::Matrix3d& direction, const Eigen::Vector3d& origin_mm) {
  Volume volume;
  volume.size = {5, 4, 3};
  volume.spacing_mm = {0.8, 1.25, 3};
  volume.direction = direction;
  volume.origin_mm = origin_mm;
  for_each_voxel(volume.size, [&](int i, int j, int k) {
    const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, j, k)));
    volume.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
  });
  return volume;
}

double largest_ramp_error(const Volume& volume) {
  double largest = 0;
  for_each_voxel(volume.size, [&](int i, int j, int k) {
    const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, j, k)));
    largest = std::max(largest, std::abs(hu - volume.at(i, j, k)));
  });
  return largest;
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string gzipped(const std::string& bytes) {
  z_stream z{};
  constexpr int kGzip = 16 + MAX_WBITS;
  deflateInit2(&z, 6, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&z, bytes.size()), '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

const Volume& dicom_abdomen() {
  static const Volume volume = read_volume(shared_data("ct/abdomen/example_ct_dicom"));
  return volume;
}

std::string voxel_bytes(const Volume& volume) {
  return {reinterpret_cast<const char*>(volume.voxels.data()), volume.voxels.size() * 2};
}

namespace {

const Eigen::Vector3d kRasFromLps(-1, -1, 1);

class HeaderBytes {
 public:
  explicit HeaderBytes(bool big_endian, std::size_t size = 348)
      : big_endian_(big_endian), bytes_(size, '\0') {}
  template <typename T>
  void put(std::size_t offset, T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_endian_) std::reverse(raw, raw + sizeof(T));
    bytes_.replace(offset, sizeof(T), raw, sizeof(T));
  }
  std::string& bytes() { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

}  // namespace

NiftiBytes::NiftiBytes(const Volume& volume) : voxels(voxel_bytes(volume)) {
  const Eigen::Matrix3d axes =
      kRasFromLps.asDiagonal() * volume.direction * volume.spacing_mm.asDiagonal();
  for (int row = 0; row < 3; ++row) {
    dim[static_cast<std::size_t>(row + 1)] = static_cast<std::int16_t>(volume.size[row]);
    pixdim[static_cast<std::size_t>(row + 1)] = static_cast<float>(volume.spacing_mm[row]);
    for (int column = 0; column < 3; ++column) {
      sform[4 * row + column] = static_cast<float>(axes(row, column));
    }
    sform[4 * row + 3] = static_cast<float>(kRasFromLps[row] * volume.origin_mm[row]);
  }
}

void NiftiBytes::set_qform(const Volume& volume) {
  Eigen::Matrix3d direction = kRasFromLps.asDiagonal() * volume.direction;
  pixdim[0] = direction.determinant() < 0 ? -1 : 1;
  direction.col(2) *= pixdim[0];
  Eigen::Quaterniond q(direction);
  if (q.w() < 0) q.coeffs() *= -1;
  const Eigen::Vector3d origin = kRasFromLps.cwiseProduct(volume.origin_mm);
  const double values[6] = {q.x(), q.y(), q.z(), origin.x(), origin.y(), origin.z()};
  std::transform(values, values + 6, quaternion, [](double v) { return static_cast<float>(v); });
  qform_code = 1;
}

void NiftiBytes::set_named_labels() {
  std::string xml(8, '\0');
  xml +=
      "<CaretExtension><LabelTable><Label Key=\"5\" Red=\"0\"><![CDATA[liver]]></Label>"
      "<Label Key=\"11\">gall bladder</Label><Label Key=\"x\">none</Label></LabelTable>";
  xml.resize(512, '\0');
  vox_offset = 352 + 512;
  for (std::size_t i = 0; i < voxels.size(); i += 2) {
    voxels[i] = static_cast<char>(i % 4 == 0 ? 5 : 11);
    voxels[i + 1] = 0;
  }
  voxels = xml + voxels;
}

std::string NiftiBytes::bytes() const {
  HeaderBytes header(big_endian);
  header.put(0, sizeof_hdr);
  for (std::size_t i = 0; i < 8; ++i) {
    header.put(40 + 2 * i, dim[i]);
    header.put(76 + 4 * i, pixdim[i]);
  }
  header.put(70, datatype);
  header.put(108, vox_offset);
  header.put(112, slope);
  header.put(116, intercept);
  header.put(123, units);
  header.put(252, qform_code);
  header.put(254, sform_code);
  for (std::size_t i = 0; i < 6; ++i) header.put(256 + 4 * i, quaternion[i]);
  for (std::size_t i = 0; i < 12; ++i) header.put(280 + 4 * i, sform[i]);
  header.bytes().replace(344, 4, magic);
  return header.bytes() + std::string(4, '\0') + voxels;
}

std::string NiftiBytes::bytes_nifti2() const {
  HeaderBytes header(big_endian, 540);
  header.put(0, std::int32_t{540});
  header.put(12, datatype);
  for (std::size_t i = 0; i < 8; ++i) {
    header.put(16 + 8 * i, static_cast<std::int64_t>(dim[i]));
    header.put(104 + 8 * i, static_cast<double>(pixdim[i]));
  }
  header.put(168, std::int64_t{544});
  header.put(176, static_cast<double>(slope));
  header.put(184, static_cast<double>(intercept));
  header.put(344, static_cast<std::int32_t>(qform_code));
  header.put(348, static_cast<std::int32_t>(sform_code));
  for (std::size_t i = 0; i < 6; ++i) header.put(352 + 8 * i, static_cast<double>(quaternion[i]));
  for (std::size_t i = 0; i < 12; ++i) header.put(400 + 8 * i, static_cast<double>(sform[i]));
  header.put(500, static_cast<std::int32_t>(units));
  header.bytes().replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
  return header.bytes() + std::string(4, '\0') + voxels;
}

void NiftiBytes::swap_to_big_endian() {
  big_endian = true;
  for (std::size_t i = 0; i + 1 < voxels.size(); i += 2) std::swap(voxels[i], voxels[i + 1]);
}

namespace {

template <typename Number>
void append_big_endian(std::string& bytes, Number value) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  bytes.append(std::reverse_iterator(raw + sizeof(Number)), std::reverse_iterator(raw));
}

std::string spaced(const Eigen::Vector3d& v) {
  return to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z());
}

// As VTK's and OFF's texts have faces.
std::string corner_lines(const TriangleMesh& mesh) {
  std::string text;
  for (const auto& [a, b, c] : mesh.faces)
    text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  return text;
}

}  // namespace

std::string as_obj(const TriangleMesh& mesh) {
  std::string text = "# made by a test\n";
  for (const auto& v : mesh.vertices) text += "v " + spaced(v) + "\n";
  for (const Face& f : mesh.faces) {
    text += "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " +
            std::to_string(f[2] + 1) + "\n";
  }
  return text;
}

std::string as_vtk(const TriangleMesh& mesh, const std::string& more) {
  std::string text = "# vtk DataFile Version 3.0\ntest\nASCII\nDATASET POLYDATA\nPOINTS " +
                     std::to_string(mesh.vertices.size()) + " double\n";
  for (const auto& v : mesh.vertices) text += spaced(v) + "\n";
  text += "POLYGONS " + std::to_string(mesh.faces.size()) + " " +
          std::to_string(4 * mesh.faces.size()) + "\n";
  return text + corner_lines(mesh) + more;
}

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
      text += "vertex " + spaced(p) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid test\n";
}

std::string as_vtp(const TriangleMesh& mesh) {
  std::string points, corners, ends;
  for (const auto& v : mesh.vertices) points += spaced(v) + " ";
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

std::string as_vtu(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<std::vector<std::uint32_t>>& cells, int kind) {
  std::string places, corners, ends, kinds;
  for (const auto& v : points) places += spaced(v) + " ";
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
  for (const auto& v : mesh.vertices) text += spaced(v) + "\n";
  return text + corner_lines(mesh);
}

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
