// SPDX-License-Identifier: GPL-3.0-or-later
// How long a bake will take and how much memory, by the sizes of its inputs and the options that
// cost time. The constants were measured.
#include "organbake/pipelines/batch_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "organbake/core/files.h"
#include "organbake/pipelines/runner.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerVoxel = 2;  // CT is stored in 16 bits

// Of a file, or of all files in a folder.
double bytes_of(const fs::path& path) {
  if (!fs::exists(path)) throw NoInputError(path, "does not exist");
  if (!fs::is_directory(path)) return static_cast<double>(fs::file_size(path));
  double bytes = 0;
  for (const fs::path& file : list_files(path)) {
    bytes += static_cast<double>(fs::file_size(path / file));
  }
  return bytes;
}

// The number of voxels that a text header's line "key = 57 78 64" or "key: …" tells; 0 when it has
// none.
double product_in_header(const fs::path& file, const std::string& key) {
  constexpr std::size_t kMostHeader = 4096;
  std::string head(kMostHeader, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(kMostHeader));
  std::istringstream lines(head);
  std::string line;
  while (std::getline(lines, line)) {
    if (!line.starts_with(key)) continue;
    std::istringstream numbers(line.substr(line.find_first_of("=:") + 1));
    double product = 1, number = 0;
    bool any = false;
    while (numbers >> number) {
      product *= number;
      any = true;
    }
    return any ? product : 0;
  }
  return 0;
}

// A gzip file ends with the size of what it holds, modulo 2³².
double unpacked_bytes(const fs::path& file) {
  std::array<unsigned char, 4> tail{};
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(-4, std::ios::end);
  if (!stream.read(reinterpret_cast<char*>(tail.data()), tail.size())) return bytes_of(file);
  const double size = tail[0] + 256.0 * (tail[1] + 256.0 * (tail[2] + 256.0 * tail[3]));
  return std::max(size, bytes_of(file));
}

}  // namespace

double voxels_in(const fs::path& volume) {
  const double bytes = bytes_of(volume);
  if (fs::is_directory(volume)) return bytes / kBytesPerVoxel;
  const std::string ending = volume.extension().string();
  if (ending == ".gz") return unpacked_bytes(volume) / kBytesPerVoxel;
  double voxels = 0;
  if (ending == ".mha" || ending == ".mhd") voxels = product_in_header(volume, "DimSize");
  if (ending == ".nrrd" || ending == ".nhdr") voxels = product_in_header(volume, "sizes");
  return voxels > 0 ? voxels : bytes / kBytesPerVoxel;
}

namespace {

// Seconds of one core (Zen 4) and bytes of memory, measured with /usr/bin/time and rounded up: the
// phantom organ of 64×64×24 … 384×384×144 voxels with 8 photographs of 1024² pixels; a liver of
// 512×512×20 voxels with its mask; 8 × 512² and 16 × 1024² maps; a clip of 1280×720, a frame of
// 1920×1080.
namespace cost {
constexpr double kProgram_s = 0.3, kProgram_mb = 70;  // starting programs, writing, a picture
constexpr double kPhantomVoxel_s = 0.25e-6, kPhantomVoxel_bytes = 4.5;
constexpr double kPhotoPixel_s = 1.4e-6, kPhotoPixel_bytes = 14;
constexpr double kVoxel_s = 0.3e-6, kVoxel_bytes = 10;  // decoded, smoothed, contoured
constexpr double kFacesOfVoxels = 6;  // of a surface, for (voxels of the scan)^⅔
constexpr double kDecimate_s = 2.5;   // the fit, whatever the surface's size
constexpr double kFace_s = 12e-6, kFace_bytes = 250;
constexpr double kFaceInFile_bytes = 19;  // of a binary PLY, with its share of vertices
constexpr double kColorPixel_bytes = 10;  // of a photograph that colours the surface
constexpr double kTexel_s = 1.6e-6, kTexel_bytes = 45;           // of the cameras' maps
constexpr double kFramePixel_s = 12e-9, kFramePixel_bytes = 25;  // decoded, at full size
constexpr double kShadedPixel_s = 1.4e-6, kShadedPixel_bytes = 110;
// Features followed in each frame, views posed and kept in memory, depth of a key frame.
constexpr double kFollowedPixel_s = 60e-9, kViews_s = 20, kViewPixel_bytes = 5, kMostViews = 80;
constexpr double kSweptPixel_s = 8e-6, kSweptPixel_bytes = 400;
constexpr double kBytesPerMb = 1024.0 * 1024.0;
}  // namespace cost

constexpr double kFramePixels = 1920.0 * 1080.0;  // of clips, which are not opened
constexpr double kFramesInMemory = 4;

// Pixels of the pictures that lie beside a cameras.json, by their bytes.
double pixels_beside(const fs::path& cameras) {
  constexpr double kBytesPerPixel = 1;  // of a photograph as PNG; of JPEG far less
  double bytes = 0;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::absolute(cameras).parent_path())) {
    if (entry.is_regular_file() && is_picture_name(entry.path())) {
      bytes += static_cast<double>(entry.file_size());
    }
  }
  return bytes / kBytesPerPixel;
}

// Frames of a picture (1), a folder (the pictures in it), or a video (by its bytes).
double frames_in(const fs::path& clip) {
  const double bytes = bytes_of(clip);
  if (fs::is_directory(clip)) {
    const std::vector<fs::path> files = list_numbered_files(clip);
    return static_cast<double>(std::count_if(files.begin(), files.end(), is_frame_name));
  }
  if (is_frame_name(clip)) return 1;
  constexpr double kBytesPerFrame = 10e3;  // 2 Mbit/s at 25 a second: as small as clips come
  return std::max(1.0, bytes / kBytesPerFrame);
}

// What is known while going through the steps of one bake.
class Estimator {
 public:
  explicit Estimator(const Recipe& recipe) : recipe_(recipe) {}

  void add(const Step& step) {
    const std::string& name = step.stage->name;
    if (name == "phantom") phantom();
    if (name == "shade") shade();
    if (name == "motion") motion();
    if (name == "isosurface") isosurface();
    if (name == "decimate") decimate();
    if (name == "capture") capture();
  }

  CaseEstimate result() const { return {seconds_, peak_mb_, {}}; }

 private:
  double number(const std::string& section, const std::string& key) const {
    const OptionValue value = recipe_.options.at(section).list.find(key)->get();
    const auto* whole = std::get_if<std::int64_t>(&value);
    return whole ? static_cast<double>(*whole) : std::get<double>(value);
  }

  const fs::path* input(const std::string& name) const {
    const auto found = recipe_.inputs.find(name);
    return found == recipe_.inputs.end() ? nullptr : &found->second;
  }

  // One stage's cost: its time adds up, memory is given back before the next.
  void spend(double seconds, double bytes) {
    seconds_ += seconds;
    peak_mb_ = std::max(peak_mb_, cost::kProgram_mb + bytes / cost::kBytesPerMb);
  }

  void phantom() {
    const OptionValue size = recipe_.options.at("phantom").list.find("size_voxels")->get();
    voxels_ = 1;
    for (const double n : std::get<std::vector<double>>(size)) voxels_ *= n;
    const double pixels = std::pow(number("phantom", "photo_size_px"), 2);
    spend(voxels_ * cost::kPhantomVoxel_s +
              number("phantom", "photos") * pixels * cost::kPhotoPixel_s,
          voxels_ * cost::kPhantomVoxel_bytes + pixels * cost::kPhotoPixel_bytes);
  }

  void isosurface() {
    if (const fs::path* ct = input("ct")) voxels_ = voxels_in(*ct);
    if (const fs::path* mask = input("mask")) voxels_ = std::max(voxels_, voxels_in(*mask));
    faces_ = cost::kFacesOfVoxels * std::pow(voxels_, 2.0 / 3.0);
    spend(voxels_ * cost::kVoxel_s, voxels_ * cost::kVoxel_bytes);
  }

  void shade() {
    const double shrink = std::pow(2.0, number("shade", "halvings"));
    const double pixels = kFramePixels / (shrink * shrink);
    const double frames = frames_in(*input("frames"));
    const double step = std::max(number("shade", "every"), number("shade", "sharpest"));
    spend(frames * kFramePixels * cost::kFramePixel_s +
              std::ceil(frames / step) * pixels * cost::kShadedPixel_s,
          std::min(frames, kFramesInMemory) *
              (kFramePixels * cost::kFramePixel_bytes + pixels * cost::kShadedPixel_bytes));
    faces_ = 2 * pixels / std::pow(number("shade", "mesh_step_px"), 2);
  }

  void motion() {
    const double shrink = std::pow(2.0, number("motion", "halvings"));
    const double pixels = kFramePixels / (shrink * shrink), keys = number("motion", "key_frames");
    const double frames = frames_in(*input("frames"));
    spend(frames * kFramePixels * cost::kFollowedPixel_s + cost::kViews_s +
              keys * pixels * cost::kSweptPixel_s,
          std::min(frames, cost::kMostViews) * kFramePixels * cost::kViewPixel_bytes +
              pixels * cost::kSweptPixel_bytes);
    faces_ = 2 * pixels;
  }

  void decimate() {
    if (const fs::path* surface = input("surface")) {
      faces_ = bytes_of(*surface) / cost::kFaceInFile_bytes;
    }
    spend(cost::kDecimate_s + faces_ * cost::kFace_s, faces_ * cost::kFace_bytes);
  }

  // Photographs that colour the surface are all in memory at once.
  double photo_pixels() const {
    if (const fs::path* photos = input("photos")) return pixels_beside(*photos);
    if (!recipe_.sections.contains("phantom")) return 0;
    return number("phantom", "photos") * std::pow(number("phantom", "photo_size_px"), 2);
  }

  void capture() {
    constexpr double kOfFrames_px = 1536;  // about what a frame's own pixels come to
    const double own_px = std::min(kOfFrames_px, number("place", "size_limit_px"));
    const double size_px = number("place", "size_px");
    const double texels = number("place", "count") * std::pow(size_px > 0 ? size_px : own_px, 2);
    spend(texels * cost::kTexel_s, texels * cost::kTexel_bytes + faces_ * cost::kFace_bytes +
                                       photo_pixels() * cost::kColorPixel_bytes);
  }

  const Recipe& recipe_;
  double voxels_ = 0, faces_ = 0;
  double seconds_ = cost::kProgram_s, peak_mb_ = cost::kProgram_mb;
};

}  // namespace

CaseEstimate estimate_case(const fs::path& recipe_file, const std::vector<std::string>& settings) {
  try {
    const Recipe recipe = read_recipe(recipe_file, settings);
    for (const auto& [name, path] : recipe.inputs) {
      if (!fs::exists(path)) throw NoInputError(path, "does not exist");
    }
    Estimator estimator(recipe);
    for (const Step& step : plan_bake(recipe).steps) estimator.add(step);
    return estimator.result();
  } catch (const Error& error) {
    return {0, 0, error.what()};
  } catch (const fs::filesystem_error& error) {
    return {0, 0, error.what()};
  }
}

}  // namespace organbake
