// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a user may give: volumes and masks, DICOM among them, surfaces, pictures, cameras,
// and documents in text.
#include <algorithm>
#include <filesystem>
#include <string>

#include "dicom/dicom.h"
#include "fuzz/readers.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/lighting.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/dataset/dataset.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/player/script.h"
#include "organbake/stereo/stereo_depth.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/volume/read_volume.h"
#include "support/files.h"

namespace organbake {
namespace {

using Bytes = std::span<const std::byte>;

Region middle_of(const Volume& volume) {
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Eigen::Vector3d a = volume.world_from_index(0.4 * last);
  const Eigen::Vector3d b = volume.world_from_index(0.6 * last);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

std::string first_labels(const Volume& mask) {
  constexpr std::size_t kMost = 2;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, mask.label_names.size()); ++i)
    text += (i ? "," : "") + mask.label_names[i].name;
  if (!mask.label_names.empty()) return text;
  std::size_t count = 0;
  for (const LabelCount& one : count_labels(mask))
    if (one.label > 0 && count++ < kMost)
      text += (text.empty() ? "" : ",") + std::to_string(one.label);
  return text;
}

// The volume, and what a user asks for who has seen it: the last of its time points, and of that
// the middle.
void read_all_and_a_part(const std::filesystem::path& path) {
  const Volume volume = read_volume(path, {.any_time = true});
  read_volume(path, {.region = middle_of(volume), .time = static_cast<int>(volume.time_points)});
}

// The mask, and its first two labels: by name where they have names, else by number.
void read_mask_and_labels(const std::filesystem::path& path) {
  const Volume mask = read_volume(path, {.any_time = true, .is_mask = true});
  const std::string labels = first_labels(mask);
  if (labels.empty()) return;
  read_volume(path,
              {.region = middle_of(mask), .any_time = true, .label = labels, .is_mask = true});
}

// A name of a file, whose ending tells its format, as an argument of a template.
template <std::size_t kLength>
struct Name {
  char text[kLength];
  constexpr Name(const char (&name)[kLength]) { std::copy_n(name, kLength, text); }
};

template <Name kName>
void read_scan(Bytes bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file(kName.text, bytes));
}

template <Name kName>
void read_labelled(Bytes bytes, const InputFolder& folder) {
  read_mask_and_labels(folder.file(kName.text, bytes));
}

template <Name kName>
void read_surface(Bytes bytes, const InputFolder& folder) {
  for (const Eigen::Vector3d& vertex : read_mesh(folder.file(kName.text, bytes)).vertices)
    expect_invariant(vertex.allFinite(), "a vertex is no place");
}

// Headers whose voxels lie in other files.
const std::vector<std::string> kDetached = {"scan.nhdr", "scan.mhd", "scan.hdr",
                                            "scan.img",  "1.raw",    "2.raw"};

void read_detached(Bytes bytes, const InputFolder& folder) {
  const std::filesystem::path at = folder.parts(kDetached, bytes);
  for (const char* header : {"scan.nhdr", "scan.mhd", "scan.hdr"})
    if (std::filesystem::exists(at / header)) read_all_and_a_part(at / header);
}

const std::vector<std::string> kSeries = {"1", "2", "3", "4", "DICOMDIR", "note.txt", "5", "6"};

// What is taken of a folder by itself, then the last series by its number.
void read_series(Bytes bytes, const InputFolder& folder) {
  const std::filesystem::path at = folder.parts(kSeries, bytes);
  read_all_and_a_part(at);
  const std::vector<DicomSeries> all = list_series(scan_dicom_folder(at));
  if (all.size() > 1) read_volume(at, {.series = all.back().number, .any_time = true});
}

// A sound CT slice whose only frame is the codestream.
std::string dicom_around(const std::string& syntax, const std::string& codestream) {
  constexpr std::uint16_t kSide = 16;
  DicomBytes slice;
  slice.set_position({5, -8, 0});
  slice.rows = slice.columns = kSide;
  slice.transfer_syntax = syntax;
  std::string file = slice.bytes();
  file.resize(file.size() - 12);  // the empty pixel data: tag, OW, two zeros, length
  const auto item = [](std::string bytes) {
    if (bytes.size() % 2) bytes += '\0';
    return dicom_number(0xE000FFFE, 4) + dicom_number(static_cast<std::uint32_t>(bytes.size()), 4) +
           bytes;
  };
  return file + dicom_number(0x00107FE0, 4) + std::string("OB\0\0", 4) +
         dicom_number(0xFFFFFFFF, 4) + item({}) + item(codestream) + dicom_number(0xE0DDFFFE, 4) +
         dicom_number(0, 4);
}

// The first byte tells the codestream's kind.
void read_codestream_of_frame(Bytes bytes, const InputFolder& folder) {
  constexpr const char* kSyntaxes[] = {"1.2.840.10008.1.2.5", "1.2.840.10008.1.2.4.70",
                                       "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.90"};
  if (bytes.empty()) return;
  const std::string syntax = kSyntaxes[std::to_integer<unsigned>(bytes[0]) % std::size(kSyntaxes)];
  const std::string file = dicom_around(syntax, text_of(bytes.subspan(1)));
  const ScannedFile scanned =
      scan_dicom_file(folder.file("image.dcm", bytes_of(std::string_view(file))));
  if (!scanned.slice) throw BadDataError(scanned.file, scanned.reason);
  decompress(*scanned.slice, coding_of(syntax));
}

// Told by the first bytes; all that a picture's file says is looked at.
void read_any_picture(Bytes bytes, const InputFolder& folder) {
  const Rgb8Image picture = read_picture(folder.file("picture", bytes)).color;
  expect_invariant(picture.pixels.size() == std::size_t(3) * picture.width * picture.height,
                   "a picture of another size than it says");
}

// A bundle's map, whose camera says how large it may be.
void read_map(Bytes bytes, const InputFolder&) {
  constexpr std::size_t kMostPixels = 1u << 22;
  parse_exr(bytes, "map.exr", kMostPixels);
}

constexpr int kWidth = 64, kHeight = 48;  // of the pictures that cameras are for

void read_posed(Bytes bytes, const InputFolder& folder) {
  const std::filesystem::path file = folder.file("cameras.json", bytes);
  const std::string read = cameras_to_json(read_camera_file(file));
  expect_invariant(read == cameras_to_json(cameras_from_json(read, "again")),
                   "cameras do not come back as they were written");
  read_intrinsics(file, "b.png", kWidth, kHeight);
}

void read_lens(Bytes bytes, const InputFolder& folder) {
  read_intrinsics(folder.file("lens.yml", bytes), "b.png", kWidth, kHeight);
}

const std::vector<std::string> kColmapFiles = {"cameras.txt", "images.txt", "cameras.bin",
                                               "images.bin",  "rigs.txt",   "frames.txt",
                                               "rigs.bin",    "frames.bin"};

void read_colmap(Bytes bytes, const InputFolder& folder) {
  read_camera_file(folder.parts(kColmapFiles, bytes));
}

void read_rig(Bytes bytes, const InputFolder& folder) {
  read_stereo_rig(folder.file("rig.yml", bytes), {.width = 720, .height = 576});
}

const std::vector<std::string> kRigTexts = {"c.left.intrinsics.txt", "c.left.distortion.txt",
                                            "c.right.intrinsics.txt", "c.right.distortion.txt",
                                            "c.l2r.txt"};

void read_rig_texts(Bytes bytes, const InputFolder& folder) {
  read_stereo_rig(folder.parts(kRigTexts, bytes), {.width = 720, .height = 576});
}

const std::vector<std::string> kScriptFiles = {"script.json", "cameras.json"};

void read_any_script(Bytes bytes, const InputFolder& folder) {
  read_script(folder.parts(kScriptFiles, bytes) / "script.json");
}

void read_any_recipe(Bytes bytes, const InputFolder& folder) {
  read_recipe(folder.file("recipe.yaml", bytes), {});
}

void read_lighting(Bytes bytes, const InputFolder&) {
  lighting_from_json(text_of(bytes), "lighting.json");
}

void read_mechanics(Bytes bytes, const InputFolder&) {
  constexpr std::size_t kVertices = 4;
  const std::string read =
      mechanics_to_json(mechanics_from_json(text_of(bytes), "mechanics.json", kVertices));
  expect_invariant(read == mechanics_to_json(mechanics_from_json(read, "again", kVertices)),
                   "mechanics do not come back as they were written");
}

void read_dataset(Bytes bytes, const InputFolder&) {
  dataset_spec_from_json(text_of(bytes), "dataset.json");
}

// As `organplay --scope` does, but for its size.
void read_scope(Bytes bytes, const InputFolder&) {
  constexpr int kSide_px = 12;
  LensPicture(scope_lens_from_json(text_of(bytes), "lens.json").in_size(kSide_px, kSide_px),
              "lens.json");
}

void read_manifest(Bytes bytes, const InputFolder&) {
  manifest_from_json(text_of(bytes), "manifest.json");
}

void read_table(Bytes bytes, const InputFolder& folder) {
  case_table_text(read_case_table(folder.file("cases.csv", bytes)));
}

void read_labels(Bytes bytes, const InputFolder& folder) {
  read_label_names(folder.file("labels.txt", bytes));
}

// As `organbake verify` does: any document that names one of our schemas.
void check_any_document(Bytes bytes, const InputFolder&) {
  const Document document = Document::parse_json(text_of(bytes), "document.json");
  check_document(document, schema_of(document));
}

}  // namespace

std::vector<FuzzReader> file_readers() {
  return {
      {"nifti", read_scan<"scan.nii">, "nifti", 6000},
      {"nifti-gz", read_scan<"scan.nii">, "gzip", 6000},
      {"nrrd", read_scan<"scan.nrrd">, "nrrd", 6000},
      {"seg-nrrd", read_labelled<"mask.seg.nrrd">, "nrrd", 6000},
      {"metaimage", read_scan<"scan.mha">, "metaimage", 6000},
      {"vti", read_scan<"scan.vti">, "vti", 1200},
      {"detached-volume", read_detached, "nrrd", 2400},
      {"dicom", read_scan<"image.dcm">, "dicom", 1000},
      {"dicom-folder", read_series, "dicom", 480},
      {"dicom-zip", read_scan<"series.zip">, "zip", 600},
      {"dicom-codestream", read_codestream_of_frame, "codestream", 1600},
      {"dicom-segmentation", read_labelled<"mask.dcm">, "dicom", 1000},
      {"dicom-contours", read_labelled<"mask.dcm">, "dicom", 1000},
      {"ply", read_surface<"mesh.ply">, "ply", 6000},
      {"obj", read_surface<"mesh.obj">, "obj", 6000},
      {"off", read_surface<"mesh.off">, "off", 6000},
      {"stl", read_surface<"mesh.stl">, "stl", 6000},
      {"vtk", read_surface<"mesh.vtk">, "vtk", 6000},
      {"vtp", read_surface<"mesh.vtp">, "vtk-xml", 1000},
      {"vtu", read_surface<"mesh.vtu">, "vtk-xml", 1000},
      {"glb", read_surface<"mesh.glb">, "gltf", 1000},
      {"gltf", read_surface<"mesh.gltf">, "gltf", 1000},
      {"exr-map", read_map, "exr", 3200},
      {"exr-picture", read_any_picture, "exr", 3200},
      {"png", read_any_picture, "png", 3200},
      {"jpeg", read_any_picture, "jpeg", 3200},
      {"script", read_any_script, "documents", 2400},
      {"recipe", read_any_recipe, "recipe", 480},
      {"lighting", read_lighting, "documents", 3200},
      {"mechanics", read_mechanics, "documents", 3200},
      {"dataset", read_dataset, "documents", 3200},
      {"scope-lens", read_scope, "scope-lens", 3200},
      {"manifest", read_manifest, "documents", 3200},
      {"case-table", read_table, "case-table", 1200},
      {"label-names", read_labels, "label-names", 3200},
      {"document", check_any_document, "documents", 800},
      {"cameras", read_posed, "cameras", 3200},
      {"transforms", read_posed, "cameras", 3200},
      {"lens", read_lens, "calibrations", 2000},
      {"colmap", read_colmap, "colmap", 2000},
      {"stereo-rig", read_rig, "calibrations", 1200},
      {"stereo-texts", read_rig_texts, "stereo-texts", 1200},
  };
}

}  // namespace organbake
