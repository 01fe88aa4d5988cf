// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundle/bundle.h"
#include "core/error.h"
#include "core/files.h"
#include "formats/camera_files.h"
#include "formats/gltf.h"
#include "formats/textured_mesh.h"
#include "image/png.h"
#include "image/srgb.h"
#include "pipelines/stage_module.h"
#include "pipelines/stage_options.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

Rgb8Image picture_of(const CameraMaps& maps) {
  Rgb8Image picture(maps.width, maps.height);
  for (std::size_t i = 0; i < maps.color.size(); ++i)
    for (int c = 0; c < 3; ++c) picture.pixels[3 * i + c] = srgb8_from_linear(maps.color[i][c]);
  return picture;
}

// The colour maps as pictures; the set then names them.
CameraSet write_pictures(const BundleReader& reader, const Bundle& frame, const fs::path& folder) {
  CameraSet set = frame.cameras;
  set.images.clear();
  fs::create_directories(folder / "images");
  for (std::size_t c = 0; c < set.cameras.size(); ++c) {
    const std::string name = camera_folder(c) + ".png";
    write_png(folder / "images" / name,
              picture_of(reader.read_maps(c, frame.cameras.cameras[c].intrinsics,
                                          shell_face_count(frame))));
    set.images.push_back(name);
  }
  return set;
}

void write_colmap(const BundleReader& reader, const Bundle& frame, const fs::path& folder) {
  const CameraSet set = write_pictures(reader, frame, folder);
  write_file_atomically(folder / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder / "images.txt", colmap_images_text(set));
  write_file_atomically(folder / "points3D.txt", colmap_points_text());
}

void write_transforms(const BundleReader& reader, const Bundle& frame, const fs::path& folder) {
  CameraSet set = write_pictures(reader, frame, folder);
  for (std::string& image : set.images) image = "images/" + image;
  write_file_atomically(folder / "transforms.json", transforms_json(set));
}

void write_obj(const Bundle& frame, const fs::path& folder) {
  const TexturedMesh mesh = textured_base(frame.shell().at_rest(), frame.base);
  write_file_atomically(folder / "organ.obj", obj_text(mesh, "organ.mtl"));
  write_file_atomically(folder / "organ.mtl", obj_material_text("organ.png"));
  write_png(folder / "organ.png", mesh.texture);
}

StageReport run(const StageCall& call) {
  const auto options = resolved_options<ExportOptions>(call.options_json);
  const BundleReader reader(*call.input("bundle"));
  const Bundle frame = reader.read_frame();
  switch (options.format) {
    case ExportFormat::gltf:
      write_file_atomically(call.output_folder / "organ.glb",
                            gltf_binary(frame.shell().at_rest(), frame.cameras));
      break;
    case ExportFormat::colmap:
      write_colmap(reader, frame, call.output_folder);
      break;
    case ExportFormat::transforms:
      write_transforms(reader, frame, call.output_folder);
      break;
    case ExportFormat::obj:
      write_obj(frame, call.output_folder);
      break;
  }
  return {};
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
