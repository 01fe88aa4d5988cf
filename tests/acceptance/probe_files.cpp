// SPDX-License-Identifier: GPL-3.0-or-later
#include "odd_inputs.h"
#include "organbake/bundle/bundle.h"
#include "organbake/core/files.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/write_volume.h"
#include "probes.h"
#include "support/mesh_texts.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

Volume small_volume(RandomStream& random) {
  Volume volume;
  volume.size = {5, 4, 3};
  volume.spacing_mm = {0.7, 0.7, 3};
  for (int k = 0; k < 60; ++k) volume.voxels.push_back(std::int16_t(random.below(2000)));
  return volume;
}

std::string nrrd_text(const Volume& volume) {
  return "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 5 4 3\n"
         "space directions: (0.7,0,0) (0,0.7,0) (0,0,3)\nkinds: domain domain domain\n"
         "endian: little\nencoding: raw\nspace origin: (0,0,0)\n\n" +
         voxel_bytes(volume);
}

ProbeFolder damaged_file(const ProbeFolder& folder, const std::string& name,
                         const std::string& bytes, RandomStream& random) {
  const ProbeFolder file = folder / name;
  write_file_atomically(file, chance(random, 0.2) ? bytes : damaged(bytes, random));
  return file;
}

CameraSet some_cameras(RandomStream& random) {
  const Bounds box{{-50, -50, -50}, {50, 50, 50}};
  CameraSet set;
  for (int i = 0; i < 3; ++i) {
    set.cameras.push_back(camera_round(random, box, 64));
    set.cameras.back().name = "camera " + std::to_string(i);
    set.images.push_back("photo_" + std::to_string(i) + ".png");
  }
  return set;
}

double probe_volume_files(RandomStream& random, const ProbeFolder& folder) {
  const Volume volume = small_volume(random);
  ProbeFolder file;
  switch (random.below(3)) {
    case 0:
      write_metaimage(folder / "whole.mha", volume);
      file = damaged_file(folder, "volume.mha", read_text_file(folder / "whole.mha"), random);
      break;
    case 1:
      file = damaged_file(folder, "volume.nrrd", nrrd_text(volume), random);
      break;
    default:
      file = damaged_file(folder, "volume.nii", NiftiBytes(volume).bytes(), random);
      break;
  }
  const Volume read = read_volume(file);
  check_volume(read, "volume");
  return 0;
}

double probe_mesh_files(RandomStream& random, const ProbeFolder& folder) {
  const TriangleMesh mesh = sound_organ(random);
  const std::uint64_t kind = random.below(4);
  const std::string bytes = kind == 0   ? serialise_ply(mesh)
                            : kind == 1 ? as_obj(mesh)
                            : kind == 2 ? as_ascii_stl(mesh)
                                        : as_vtk(mesh);
  const char* names[] = {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.vtk"};
  const TriangleMesh read = read_mesh(damaged_file(folder, names[kind], bytes, random));
  check_mesh(read, "mesh");
  expect_finite(read, "a vertex of a mesh that was read");
  return 0;
}

double probe_picture_files(RandomStream& random, const ProbeFolder& folder) {
  const int width = 1 + int(random.below(20)), height = 1 + int(random.below(20));
  if (chance(random, 0.5)) {
    Rgb8Image image(width, height);
    for (std::uint8_t& level : image.pixels) level = std::uint8_t(random());
    write_png(folder / "whole.png", image);
    const Rgb8Image read =
        read_png(damaged_file(folder, "picture.png", read_text_file(folder / "whole.png"), random));
    return read.pixels.size() == std::size_t(3) * read.width * read.height ? 0 : 2;
  }
  CameraMaps maps{width, height, {}, {}, {}, {}, {}};
  for (int k = 0; k < width * height; ++k) {
    maps.depth_mm.push_back(float(random.uniform(1, 100)));
    maps.height_mm.push_back(float(random.normal()));
    maps.face.push_back(std::uint32_t(random.below(80)));
    maps.confidence.push_back(float(random.uniform()));
  }
  const ExrCompression kinds[] = {ExrCompression::none, ExrCompression::zip, ExrCompression::piz,
                                  ExrCompression::pxr24};
  ExrWriteOptions options;
  options.compression = kinds[random.below(4)];
  write_exr(folder / "whole.exr", micro_image(maps), options);
  const ChannelImage read =
      read_exr(damaged_file(folder, "map.exr", read_text_file(folder / "whole.exr"), random));
  return read.width > 0 && read.height > 0 ? 0 : 2;
}

double probe_documents(RandomStream& random, const ProbeFolder& folder) {
  const CameraSet cameras = some_cameras(random);
  const std::uint64_t kind = random.below(4);
  if (kind == 0) {
    const TriangleMesh proxy = sound_organ(random);
    const std::string text = damaged(mechanics_to_json(make_mechanics(proxy, {})), random);
    const MechanicsModel model = mechanics_from_json(text, "mechanics", proxy.vertices.size());
    const std::string again = mechanics_to_json(model);
    const std::size_t count = proxy.vertices.size();
    return again == mechanics_to_json(mechanics_from_json(again, "again", count)) ? 0 : 2;
  }
  const std::string text = kind == 1   ? cameras_to_json(cameras)
                           : kind == 2 ? transforms_json(cameras)
                                       : colmap_images_text(cameras);
  if (kind == 3) write_file_atomically(folder / "cameras.txt", colmap_cameras_text(cameras));
  const CameraSet read = read_camera_file(
      damaged_file(folder, kind == 3 ? "images.txt" : "cameras.json", text, random));
  for (const PosedCamera& camera : read.cameras)
    expect_finite(
        camera.camera_from_world.rotation.sum() + camera.camera_from_world.translation.sum(),
        "a camera that was read");
  const std::string again = cameras_to_json(read);
  return again == cameras_to_json(cameras_from_json(again, "again")) ? 0 : 2;
}

}  // namespace

std::vector<Probe> file_probes() {
  return {
      {"volumefiles", "a volume that is none", probe_volume_files},
      {"meshfiles", "a mesh that is none", probe_mesh_files},
      {"picturefiles", "a picture that is none", probe_picture_files},
      {"documents", "a document that does not come back as it was", probe_documents},
  };
}

}  // namespace organbake
