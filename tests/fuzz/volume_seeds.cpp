// SPDX-License-Identifier: GPL-3.0-or-later
#include <bzlib.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkXMLImageDataWriter.h>
#include <vtkXMLWriter.h>

#include "fuzz/seeds.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {

Seeds vtk_writings(vtkXMLWriter& writer) {
  struct Form {
    int mode;
    bool base64;  // of appended data
    int compressor, byte_order, counts;
  };
  using W = vtkXMLWriter;
  static constexpr Form kForms[] = {
      {W::Ascii, true, W::NONE, W::LittleEndian, W::UInt32},
      {W::Binary, true, W::NONE, W::BigEndian, W::UInt32},
      {W::Binary, true, W::ZLIB, W::LittleEndian, W::UInt64},
      {W::Appended, true, W::ZLIB, W::BigEndian, W::UInt32},
      {W::Appended, false, W::NONE, W::LittleEndian, W::UInt64},
      {W::Appended, false, W::ZLIB, W::LittleEndian, W::UInt32},
  };
  constexpr int kBlockBytes = 64;  // several blocks, the last one cut short
  Seeds seeds;
  writer.WriteToOutputStringOn();
  writer.SetBlockSize(kBlockBytes);
  for (const Form& form : kForms) {
    writer.SetDataMode(form.mode);
    writer.SetEncodeAppendedData(form.base64);
    writer.SetCompressorType(form.compressor);
    writer.SetByteOrder(form.byte_order);
    writer.SetHeaderType(form.counts);
    writer.Write();
    seeds.push_back(writer.GetOutputString());
  }
  return seeds;
}

std::string vtk_lz4_writing(vtkXMLWriter& writer) {
  writer.WriteToOutputStringOn();
  writer.SetDataModeToAppended();
  writer.SetCompressorTypeToLZ4();
  writer.Write();
  return writer.GetOutputString();
}

namespace {

constexpr std::size_t kVoxels = 60;  // of the ramp

std::string as_decimals(const Volume& volume) {
  std::string text;
  for (const std::int16_t voxel : volume.voxels) text += std::to_string(voxel) + " ";
  return text;
}

// Voxels of any type: bytes that are sound numbers of each.
std::string voxels_of_width(std::size_t width) {
  std::string bytes;
  for (std::size_t i = 0; i < kVoxels * width; ++i) bytes += static_cast<char>(0x3A + i % 7);
  return bytes;
}

std::string bzipped(const std::string& bytes) {
  std::string out(bytes.size() + 1024, '\0');
  auto length = static_cast<unsigned>(out.size());
  BZ2_bzBuffToBuffCompress(out.data(), &length, const_cast<char*>(bytes.data()),
                           static_cast<unsigned>(bytes.size()), 9, 0, 0);
  out.resize(length);
  return out;
}

// NIfTI's numbers for types of voxels, and how many bytes each takes.
constexpr std::pair<std::int16_t, std::size_t> kNiftiTypes[] = {
    {2, 1}, {8, 4}, {16, 4}, {64, 8}, {256, 1}, {512, 2}, {768, 4}, {1024, 8}, {1280, 8}};

std::string nifti_of_type(std::int16_t type, std::size_t width) {
  NiftiBytes typed(ramp_volume(oblique_direction()));
  typed.datatype = type;
  typed.voxels = voxels_of_width(width);
  return typed.bytes();
}

Seeds all_gzipped(const Seeds& seeds) {
  Seeds all;
  for (const std::string& seed : seeds) all.push_back(gzipped(seed));
  return all;
}

Seeds nifti_placements() {
  const Volume truth = ramp_volume(oblique_direction());
  NiftiBytes turned(truth), both(truth), nowhere(truth), sheared(ramp_volume()),
      bent(ramp_volume());
  turned.set_qform(truth);
  turned.sform_code = 0;
  both.set_qform(ramp_volume());
  both.units = 1;  // metres
  nowhere.sform_code = 0;
  sheared.sform[1] = 0.5f;
  bent.sform[1] = 0.005f;
  return {turned.bytes(), both.bytes(), nowhere.bytes(), sheared.bytes(), bent.bytes()};
}

std::string nrrd_header(const std::string& more) {
  return "NRRD0004\n# a comment\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\n"
         "space: left-posterior-superior\nspace directions: (0.8,0,0) (0,1.25,0) (0,0,3)\n"
         "space origin: (-40,25,110)\n" +
         more;
}

std::string nrrd_of_type(const char* type, std::size_t width) {
  return std::string("NRRD0005\ntype: ") + type +
         "\ndimension: 3\nspace: RAS\nsizes: 5 4 3\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n"
         "space units: \"mm\" \"mm\" \"mm\"\nendian: big\nencoding: raw\n\n" +
         voxels_of_width(width);
}

// Two volumes, one after the other and in turns.
Seeds nrrd_times() {
  const std::string twice = voxels_of_width(2) + voxels_of_width(2);
  return {
      "NRRD0004\ntype: short\ndimension: 4\nsizes: 5 4 3 2\nspacings: 1 1 2 nan\n"
      "endian: little\nencoding: raw\n\n" +
          twice,
      "NRRD0004\ntype: short\ndimension: 4\nsizes: 2 5 4 3\nspace dimension: 3\n"
      "space directions: none (1,0,0) (0,1,0.2) (0,0,2)\nkinds: list domain domain domain\n"
      "endian: little\nencoding: raw\n\n" +
          twice,
      "NRRD0004\ntype: float\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\n\n" +
          std::string(120, '\xff') + std::string(120, 'G')};
}

std::string metaimage_header(const std::string& more, const std::string& data) {
  return "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 0.8 1.25 3\n"
         "Offset = -40 25 110\nElementType = MET_SHORT\n" +
         more + "ElementDataFile = " + data + "\n";
}

std::string metaimage_of_type(const char* type, std::size_t width) {
  return std::string("NDims = 3\nDimSize = 5 4 3\nBinaryDataByteOrderMSB = True\nElementType = ") +
         type + "\nElementDataFile = LOCAL\n" + voxels_of_width(width);
}

vtkSmartPointer<vtkImageData> image_of_type(int type) {
  const auto image = vtkSmartPointer<vtkImageData>::New();
  vtkNew<vtkMatrix3x3> turned;
  turned->SetElement(0, 0, 0);
  turned->SetElement(0, 1, -1);
  turned->SetElement(1, 0, 1);
  turned->SetElement(1, 1, 0);
  image->SetExtent(-1, 3, 2, 5, 0, 2);
  image->SetSpacing(0.8, 1.25, 3);
  image->SetDirectionMatrix(turned);
  image->AllocateScalars(type, 1);
  const auto bytes = static_cast<std::size_t>(image->GetScalarSize()) * kVoxels;
  voxels_of_width(8).copy(static_cast<char*>(image->GetScalarPointer()), bytes);
  return image;
}

}  // namespace

Seeds nifti_seeds() {
  const Volume truth = ramp_volume(oblique_direction());
  NiftiBytes plain(truth), swapped(truth), scaled(truth), times(truth), later(truth),
      named(ramp_volume());
  swapped.swap_to_big_endian();
  scaled.slope = 2.5;
  scaled.intercept = -10;
  times.dim = {4, 5, 4, 3, 2, 1, 1, 1};
  times.pixdim[4] = 40;
  times.units = 2 | 16;  // millimetres, milliseconds
  times.voxels += times.voxels;
  named.set_named_labels();
  later.vox_offset = 700;
  later.voxels.insert(0, 700 - 352, '\0');
  Seeds seeds = {plain.bytes(), swapped.bytes(),      scaled.bytes(), times.bytes(),
                 later.bytes(), plain.bytes_nifti2(), named.bytes()};
  for (const auto& [type, width] : kNiftiTypes) seeds.push_back(nifti_of_type(type, width));
  append(nifti_placements(), seeds);
  return seeds;
}

Seeds zipped_nifti_seeds() {
  Seeds seeds = all_gzipped(nifti_seeds());
  const std::string whole = NiftiBytes(ramp_volume()).bytes();
  seeds.push_back(gzipped(whole.substr(0, 400)) + gzipped(whole.substr(400)) + "padding");
  return seeds;
}

Seeds refused_niftis() {
  constexpr std::int16_t kComplex = 32, kRgb = 128;
  NiftiBytes vectors(ramp_volume());
  vectors.dim = {5, 5, 4, 3, 1, 3, 1, 1};
  vectors.voxels = voxels_of_width(6);
  return {vectors.bytes(), nifti_of_type(kComplex, 8), nifti_of_type(kRgb, 3)};
}

Seeds refused_zipped_niftis() { return all_gzipped(refused_niftis()); }

Seeds nrrd_seeds() {
  const Volume truth = ramp_volume();
  const std::string raw = voxel_bytes(truth);
  Seeds seeds = {nrrd_header("encoding: raw\n\n") + raw,
                 nrrd_header("encoding: gzip\n\n") + gzipped(raw),
                 nrrd_header("encoding: bzip2\n\n") + bzipped(raw),
                 nrrd_header("encoding: ascii\n\n") + as_decimals(truth),
                 nrrd_header("encoding: raw\nbyte skip: -1\nkey:=value\n\n") + raw,
                 nrrd_header("encoding: gz\nbyte skip: -1\n\n") + gzipped("before" + raw),
                 nrrd_header("encoding: raw\nline skip: 1\nbyte skip: 2\n\n") + "a line\n.." + raw};
  for (const auto& [type, width] :
       std::initializer_list<std::pair<const char*, std::size_t>>{{"uchar", 1},
                                                                  {"int8", 1},
                                                                  {"ushort", 2},
                                                                  {"int", 4},
                                                                  {"uint32", 4},
                                                                  {"int64", 8},
                                                                  {"unsigned long long", 8},
                                                                  {"float", 4},
                                                                  {"double", 8}})
    seeds.push_back(nrrd_of_type(type, width));
  append(nrrd_times(), seeds);
  return seeds;
}

// Two segments in two layers, as 3D Slicer saves them.
Seeds layered_mask_seeds() {
  const auto segment = [](int i, const std::string& name, int layer) {
    const std::string key = "Segment" + std::to_string(i) + "_";
    return key + "ID:=S_" + std::to_string(i) + "\n" + key + "Name:=" + name + "\n" + key +
           "LabelValue:=1\n" + key + "Layer:=" + std::to_string(layer) + "\n";
  };
  const std::string names = segment(0, "spleen", 0) + segment(1, "liver", 1) + "\n";
  const std::string head = "NRRD0004\ntype: uchar\nspace: left-posterior-superior\n";
  std::string layers, flat;
  for (std::size_t i = 0; i < kVoxels; ++i) {
    layers += {static_cast<char>(i < 20), static_cast<char>(i >= 10)};
    flat += static_cast<char>(i % 3);
  }
  const std::string layered =
      head +
      "dimension: 4\nsizes: 2 5 4 3\nspace directions: none (1,0,0) (0,1,0) (0,0,2)\n"
      "kinds: list domain domain domain\nspace origin: (1,2,3)\n";
  const std::string single =
      head + "dimension: 3\nsizes: 5 4 3\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n";
  return {layered + "encoding: raw\n" + names + layers,
          layered + "encoding: gzip\n" + names + gzipped(layers),
          single + "encoding: bzip2\nSegment0_ID:=S_0\nSegment0_LabelValue:=2\n\n" + bzipped(flat),
          single + "encoding: raw\n\n" + flat};
}

Seeds metaimage_seeds() {
  const TemporaryFolder folder;
  write_metaimage(folder.path() / "a.mha", ramp_volume(oblique_direction()));
  const std::string raw = voxel_bytes(ramp_volume());
  Seeds seeds = {
      read_text_file(folder.path() / "a.mha"), metaimage_header("", "LOCAL") + raw,
      metaimage_header("CompressedData = True\nTransformMatrix = 1 0 0 0.2 1 0 0 0 1\n", "LOCAL") +
          gzipped(raw),
      "NDims = 4\nDimSize = 5 4 3 2\nElementSize = 1 1 2 40\nOrientation = 1 0 0 0 0 1 0 0 0 0 1 0 "
      "0 0 0 1\nPosition = 1 2 3 0\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
          raw + raw,
      metaimage_header("BinaryData = False\nHeaderSize = -1\n", "LOCAL") +
          as_decimals(ramp_volume())};
  for (const auto& [type, width] :
       std::initializer_list<std::pair<const char*, std::size_t>>{{"MET_CHAR", 1},
                                                                  {"MET_UCHAR", 1},
                                                                  {"MET_USHORT", 2},
                                                                  {"MET_INT", 4},
                                                                  {"MET_ULONG", 4},
                                                                  {"MET_LONG_LONG", 8},
                                                                  {"MET_ULONG_LONG", 8},
                                                                  {"MET_FLOAT", 4},
                                                                  {"MET_DOUBLE", 8}})
    seeds.push_back(metaimage_of_type(type, width));
  return seeds;
}

Seeds vti_seeds() {
  Seeds seeds;
  for (const int type : {VTK_SHORT, VTK_DOUBLE, VTK_UNSIGNED_CHAR}) {
    vtkNew<vtkXMLImageDataWriter> writer;
    writer->SetInputData(image_of_type(type));
    append(vtk_writings(*writer), seeds);
  }
  return seeds;
}

Seeds refused_vtis() {
  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(image_of_type(VTK_SHORT));
  return {vtk_lz4_writing(*writer)};
}

Seeds detached_volume_seeds() {
  const std::string voxels = voxel_bytes(ramp_volume());
  const std::string first = voxels.substr(0, 60), second = voxels.substr(60);
  NiftiBytes pair(ramp_volume());
  pair.magic = std::string("ni1\0", 4);
  pair.vox_offset = 0;
  const std::string whole = pair.bytes();
  const auto nrrd = [](const std::string& more) { return nrrd_header("encoding: raw\n" + more); };
  return {joined_parts({{0, nrrd("data file: 1.raw\n")}, {4, voxels}}),
          joined_parts({{0, nrrd("line skip: 2\ndata file: 1.raw\n")}, {4, "\n\n" + voxels}}),
          joined_parts({{0, nrrd("data file: %d.raw 1 2 1\n")}, {4, first}, {5, second}}),
          joined_parts({{0, nrrd("data file: LIST 3\n1.raw\n2.raw\n")}, {4, first}, {5, second}}),
          joined_parts({{1, metaimage_header("", "1.raw")}, {4, voxels}}),
          joined_parts({{1, metaimage_header("HeaderSize = 3\n", "1.raw")}, {4, "abc" + voxels}}),
          joined_parts({{1, metaimage_header("HeaderSize = -1\n", "1.raw")}, {4, "ab" + voxels}}),
          joined_parts({{1, metaimage_header("", "LIST\n1.raw\n2.raw")}, {4, first}, {5, second}}),
          joined_parts({{1, metaimage_header("", "%d.raw 1 2 1")}, {4, first}, {5, second}}),
          joined_parts({{2, whole.substr(0, 348)}, {3, voxels}})};
}

}  // namespace organbake
