// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's own writers, in every form that they have, against the reader.
#include "organbake/formats/vtk_xml.h"

#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkDoubleArray.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>
#include <zlib.h>

#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/files.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

struct Form {
  int mode = vtkXMLWriter::Ascii;
  bool base64 = true;  // of appended data
  int compressor = vtkXMLWriter::NONE;
  int byte_order = vtkXMLWriter::LittleEndian;
  int header = vtkXMLWriter::UInt32;
};

std::vector<Form> every_form() {
  std::vector<Form> forms = {{}};
  for (const int compressor : {vtkXMLWriter::NONE, vtkXMLWriter::ZLIB})
    for (const int order : {vtkXMLWriter::LittleEndian, vtkXMLWriter::BigEndian})
      for (const int header : {vtkXMLWriter::UInt32, vtkXMLWriter::UInt64}) {
        forms.push_back({vtkXMLWriter::Binary, true, compressor, order, header});
        for (const bool base64 : {true, false})
          forms.push_back({vtkXMLWriter::Appended, base64, compressor, order, header});
      }
  return forms;
}

void write_as(const Form& form, vtkXMLWriter* writer, const std::filesystem::path& file) {
  writer->SetDataMode(form.mode);
  writer->SetEncodeAppendedData(form.base64);
  writer->SetCompressorType(form.compressor);
  writer->SetByteOrder(form.byte_order);
  writer->SetHeaderType(form.header);
  writer->SetBlockSize(800);  // several blocks, the last one cut short
  writer->SetFileName(file.c_str());
  ASSERT_EQ(writer->Write(), 1);
}

class VtkXml : public ::testing::Test {
 protected:
  VtkXml() {
    points_->SetDataTypeToDouble();
    for (const auto& v : truth_.vertices) points_->InsertNextPoint(v.data());
    for (const Face& f : truth_.faces) {
      const vtkIdType corners[] = {f[0], f[1], f[2]};
      cells_->InsertNextCell(3, corners);
    }
  }

  TemporaryFolder folder_;
  TriangleMesh truth_ = lumpy_mesh(30, 2);
  vtkNew<vtkPoints> points_;
  vtkNew<vtkCellArray> cells_;
};

TEST_F(VtkXml, PolydataInEveryForm) {
  vtkNew<vtkPolyData> polydata;
  polydata->SetPoints(points_);
  polydata->SetPolys(cells_);
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("shade");
  colors->SetNumberOfComponents(3);
  for (std::size_t v = 0; v < truth_.vertices.size(); ++v) {
    const double rgb[] = {255, double(v % 256), 0};
    colors->InsertNextTuple(rgb);
  }
  polydata->GetPointData()->SetScalars(colors);
  for (const Form& form : every_form()) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetInputData(polydata);
    write_as(form, writer, folder_.path() / "a.vtp");
    const TriangleMesh mesh = read_mesh(folder_.path() / "a.vtp");
    ASSERT_EQ(mesh.vertices, truth_.vertices) << form.mode << form.base64 << form.compressor;
    ASSERT_EQ(mesh.faces, truth_.faces) << form.mode << form.base64 << form.compressor;
    ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
    EXPECT_FLOAT_EQ(mesh.colors[3].x(), 1);
    EXPECT_LT(mesh.colors[3].y(), mesh.colors[200 % mesh.colors.size()].y());
  }
}

TEST_F(VtkXml, GridsInEveryForm) {
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(points_);
  grid->SetCells(VTK_TRIANGLE, cells_);
  for (const Form& form : every_form()) {
    vtkNew<vtkXMLUnstructuredGridWriter> writer;
    writer->SetInputData(grid);
    write_as(form, writer, folder_.path() / "a.vtu");
    const TriangleMesh mesh = read_mesh(folder_.path() / "a.vtu");
    ASSERT_EQ(mesh.vertices.size(), truth_.vertices.size());
    ASSERT_EQ(mesh.faces.size(), truth_.faces.size());
  }
}

std::string base64(const std::string& bytes) { return to_base64(std::as_bytes(std::span(bytes))); }

// An array as base64, its header encoded apart from what follows or together with it.
template <class Word, class Number>
std::string encoded(const std::vector<Number>& numbers, bool packed, bool apart) {
  std::string data(reinterpret_cast<const char*>(numbers.data()), sizeof(Number) * numbers.size());
  std::vector<Word> header = {static_cast<Word>(data.size())};
  if (packed) {
    std::string block(compressBound(data.size()), '\0');
    uLongf length = block.size();
    compress(reinterpret_cast<Bytef*>(block.data()), &length,
             reinterpret_cast<const Bytef*>(data.data()), data.size());
    block.resize(length);
    header = {1, static_cast<Word>(data.size()), 0, static_cast<Word>(length)};
    data = block;
  }
  const std::string head(reinterpret_cast<const char*>(header.data()),
                         sizeof(Word) * header.size());
  return apart ? base64(head) + base64(data) : base64(head + data);
}

// Whatever a program's habit: VTK encodes headers of packed arrays apart, others all of them, or
// none.
TEST_F(VtkXml, HeadersEncodedApartOrTogetherAreRead) {
  std::vector<double> places;
  for (const auto& v : truth_.vertices) places.insert(places.end(), v.data(), v.data() + 3);
  std::vector<std::int64_t> corners, ends;
  for (const Face& face : truth_.faces) {
    corners.insert(corners.end(), face.begin(), face.end());
    ends.push_back(std::ssize(corners));
  }
  const auto file = [&](bool wide, bool packed, bool apart) {
    const auto array = [&](const char* tag, const auto& numbers) {
      return "<DataArray format=\"binary\" " + std::string(tag) + ">" +
             (wide ? encoded<std::uint64_t>(numbers, packed, apart)
                   : encoded<std::uint32_t>(numbers, packed, apart)) +
             "</DataArray>";
    };
    return "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\" header_type=\"" +
           std::string(wide ? "UInt64" : "UInt32") + "\"" +
           (packed ? " compressor=\"vtkZLibDataCompressor\"" : "") +
           "><PolyData><Piece NumberOfPoints=\"" + std::to_string(truth_.vertices.size()) +
           "\" NumberOfPolys=\"" + std::to_string(truth_.faces.size()) + "\"><Points>" +
           array("type=\"Float64\" NumberOfComponents=\"3\"", places) + "</Points><Polys>" +
           array("type=\"Int64\" Name=\"connectivity\"", corners) +
           array("type=\"Int64\" Name=\"offsets\"", ends) + "</Polys></Piece></PolyData></VTKFile>";
  };
  for (const bool wide : {false, true})
    for (const bool packed : {false, true})
      for (const bool apart : {false, true}) {
        write_bytes(folder_.path() / "a.vtp", file(wide, packed, apart));
        const TriangleMesh mesh = read_mesh(folder_.path() / "a.vtp");
        EXPECT_EQ(mesh.vertices, truth_.vertices) << wide << packed << apart;
        EXPECT_EQ(mesh.faces, truth_.faces) << wide << packed << apart;
      }
}

// One cell of every kind, as VTK 9 itself places it in a unit box; its curved pyramid bulges there.
TEST_F(VtkXml, TheOutsideOfEveryKindOfCellIsClosedAndLooksOutward) {
  const std::map<int, double> volumes = {{10, 1. / 6}, {11, 1},      {12, 1},   {13, 0.5},
                                         {14, 1. / 3}, {24, 1. / 6}, {25, 1},   {26, 0.5},
                                         {27, -1},     {29, 1},      {31, 0.5}, {32, 0.5},
                                         {33, 1},      {15, -1},     {16, -1}};  // −1: some
  constexpr double kSize_mm = 100, kRounding = 1e-6;
  for (const auto& [kind, volume] : volumes) {
    const auto cell = vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(kind));
    std::vector<Eigen::Vector3d> points;
    std::vector<std::uint32_t> nodes;
    for (vtkIdType p = 0; p < cell->GetNumberOfPoints(); ++p) {
      points.push_back(kSize_mm * Eigen::Map<Eigen::Vector3d>(cell->GetParametricCoords() + 3 * p));
      nodes.push_back(static_cast<std::uint32_t>(p));
    }
    write_bytes(folder_.path() / "a.vtu", as_vtu(points, {nodes}, kind));
    std::string said;
    const RunContext context([&](LogLevel, std::string_view text) { said += text; }, {}, nullptr);
    const TriangleMesh mesh = read_mesh(folder_.path() / "a.vtu", {}, context);
    EXPECT_TRUE(analyse_topology(mesh).closed_manifold()) << kind;
    EXPECT_EQ(said, "") << kind << ": nothing had to be turned or welded";
    const double found = signed_volume(mesh) / std::pow(kSize_mm, 3);
    if (volume > 0)
      EXPECT_NEAR(found, volume, kRounding) << kind;
    else
      EXPECT_GT(found, 0.1) << kind;
  }
}

TEST_F(VtkXml, FlatCellsOnASolidAreNoSecondSkin) {
  const std::vector<Eigen::Vector3d> corners = {{0, 0, 0}, {90, 0, 0}, {0, 90, 0}, {0, 0, 90}};
  std::string text = as_vtu(corners, {{0, 1, 2, 3}, {0, 2, 1}, {0, 1, 3}}, 10);
  const std::string kinds = ">10 10 10 <";
  ASSERT_NE(text.find(kinds), text.npos);
  text.replace(text.find(kinds), kinds.size(), ">10 5 5 <");
  write_bytes(folder_.path() / "a.vtu", text);
  const TriangleMesh mesh = read_mesh(folder_.path() / "a.vtu");
  EXPECT_EQ(mesh.faces.size(), 4u);
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
}

TEST_F(VtkXml, RefusesWhatVtkWouldTrust) {
  const auto error = [&](const std::string& name, std::string text, const std::string& from,
                         const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, text.npos) << from;
    text.replace(at, from.size(), to);
    write_bytes(folder_.path() / name, text);
    return message_of(ExitCode::bad_data, [&] { read_mesh(folder_.path() / name); });
  };
  const std::string vtp = as_vtp(tetrahedron_mesh());
  const std::string vtu = as_vtu(tetrahedron_mesh().vertices, {{0, 1, 2, 3}}, 10);
  EXPECT_THAT(error("a.vtp", vtp, "NumberOfPoints=\"4\"", "NumberOfPoints=\"99999999999\""),
              HasSubstr("holds 4 points, 99999999999 are wanted"));
  EXPECT_THAT(error("a.vtp", vtp, "NumberOfPolys=\"4\"", "NumberOfPolys=\"-4\""),
              HasSubstr("no count"));
  EXPECT_THAT(error("a.vtp", vtp, ">3 6 9 12 <", ">3 6 9 99 <"), HasSubstr("cell 3 ends outside"));
  EXPECT_THAT(error("a.vtp", vtp, ">3 6 9 12 <", ">3 9 6 12 <"), HasSubstr("cell 2 ends outside"));
  EXPECT_THAT(error("a.vtu", vtu, ">0 1 2 3 <", ">0 1 2 4 <"), HasSubstr("uses point 4"));
  EXPECT_THAT(error("a.vtu", vtu, ">10 <", ">12 <"), HasSubstr("kind 12 and has 4 corners"));
  EXPECT_THAT(error("a.vtu", vtu, ">10 <", ">42 <"), HasSubstr("polyhedra"));
  EXPECT_THAT(error("a.vtu", vtu, ">10 <", ">77 <"), HasSubstr("not read"));
}

}  // namespace
}  // namespace organbake
