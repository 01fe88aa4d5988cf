// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's own writers, in every form that they have, against the reader.
#include "organbake/formats/vtk_xml.h"

#include <gmock/gmock.h>
#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include "file_bytes.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/formats/mesh_files.h"
#include "support/mesh_texts.h"
#include "support/meshes.h"

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
