// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "organbake/bundle/bundle.h"
#include "organbake/core/files.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/registration/register_photo.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/volume/read_volume.h"
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

namespace {

// Noise, one colour, a ramp, a lamp's spot, tissue with highlights, black with a few hot pixels.
Rgb8Image any_picture(RandomStream& random, int width, int height) {
  Rgb8Image image(width, height);
  const std::uint64_t kind = random.below(6);
  const double level = random.uniform(0, 255), noise = random.uniform(0, 20);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double dx = double(x) / width - 0.5, dy = double(y) / height - 0.5;
      double value = level;
      if (kind == 0) value = random.uniform(0, 255);
      if (kind == 2) value = 255 * (dx + 0.5);
      if (kind == 3) value = 255 / (1 + 8 * (dx * dx + dy * dy)) + noise * random.normal();
      if (kind == 4) value = chance(random, 0.02) ? 255 : 120 + noise * random.normal();
      if (kind == 5) value = chance(random, 0.01) ? 255 : 0;
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = std::uint8_t(std::clamp(value * (c == 0 ? 1 : 0.6), 0., 255.));
    }
  return image;
}

Intrinsics any_lens(RandomStream& random, int width, int height) {
  const double focal = width * any_size(random, -0.5, 1);
  Intrinsics lens{width,       height,      focal, focal * random.uniform(0.8, 1.2),
                  0.5 * width, 0.5 * height};
  if (chance(random, 0.2)) lens.k1 = random.uniform(-0.5, 0.5);
  if (chance(random, 0.05)) lens.fx = odd_number(random);
  if (chance(random, 0.02)) lens.width += 1;
  return lens;
}

double probe_shade(RandomStream& random, const ProbeFolder&) {
  const int width = 1 + int(random.below(64)), height = 1 + int(random.below(64));
  const Intrinsics lens = any_lens(random, width, height);
  const FrameOptions preparation{.halvings = int(random.below(3)),
                                 .masks = chance(random, 0.7),
                                 .piecewise_albedo = chance(random, 0.5)};
  ShadingOptions options;
  options.model = ShadingModel(random.below(3));
  options.iterations = 1 + int(random.below(50));
  options.laparoscope.texture = any_size(random, -4, 0);
  options.range_mm = chance(random, 0.5) ? 0 : any_size(random, -1, 4);
  if (chance(random, 0.2)) options.laparoscope.light_offset_x_mm = random.uniform(-20, 20);
  if (chance(random, 0.2)) options.laparoscope.beam_exponent = random.uniform(0, 8);
  if (chance(random, 0.05)) options.range_mm = odd_number(random);
  FrameDepth previous;
  double wrong = 0;
  for (int i = 0; i < 2; ++i) {
    const PreparedFrame frame =
        prepare_frame(any_picture(random, width, height), lens, preparation);
    FrameDepth result = shade_frame(frame, options, i > 0 ? &previous : nullptr);
    for (std::size_t k = 0; k < result.depth.size(); ++k) {
      if (!frame.tissue.values[k]) continue;
      expect_finite(double(result.depth.values[k]) + result.normals[k].sum(), "a depth");
      expect_finite(result.confidence.values[k], "a confidence");
      wrong += result.depth.values[k] <= 0;
    }
    previous = std::move(result);
  }
  return 2 * wrong;
}

// Pictures that show no organ: whatever pose comes out, it must not be called ok.
double probe_register(RandomStream& random, const ProbeFolder&) {
  const RegisteredSurface surface(chance(random, 0.8) ? sound_organ(random) : any_organ(random));
  const int size = 64;
  const PosedCamera camera = camera_round(random, surface.box(), size);
  PhotoToRegister photo;
  photo.image = any_picture(random, size, size);
  photo.intrinsics = chance(random, 0.9) ? camera.intrinsics : any_lens(random, size, size);
  photo.start = camera.camera_from_world;
  if (chance(random, 0.05)) photo.start->translation = any_point(random, 1000);
  RegistrationOptions options;
  options.light = LightModel(random.below(5));
  options.window = chance(random, 0.7) ? SimilarityWindow::patches : SimilarityWindow::whole;
  options.similarity = chance(random, 0.8) ? Similarity::radiance : Similarity::gradient;
  options.free_focal = chance(random, 0.2);
  options.finest_side_px = 64;
  options.outer_iterations = 1 + int(random.below(3));
  options.solver_iterations = 1 + int(random.below(6));
  const RegisteredPhoto found = register_photo(surface, photo, options);
  const RigidTransform& pose = found.camera.camera_from_world;
  expect_finite(pose.rotation.sum() + pose.translation.sum(), "a pose");
  expect_finite(found.quality.correlation, "a correlation");
  return found.quality.verdict == Verdict::ok ? 2 : 0;
}

}  // namespace

std::vector<Probe> photo_probes() {
  return {
      {"shade", "a depth that is not positive", probe_shade},
      {"register", "a wrong pose that is called ok", probe_register},
  };
}

}  // namespace organbake
