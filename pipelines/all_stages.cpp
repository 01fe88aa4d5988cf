// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text.h"
#include "pipelines/stage.h"
#include "pipelines/stage_options.h"

namespace organbake {
namespace {

template <class Options>
StageOptions make_options() {
  auto storage = std::make_shared<Options>();
  OptionList list;
  bind(list, *storage);
  return {storage, list};
}

std::vector<Stage> describe() {
  const StageInput surface = {"surface", InputKind::mesh, "the organ's surface"};
  return {
      {.name = "phantom",
       .version = 2,
       .summary = "make a synthetic organ: CT, photographs, and the truth about both",
       .inputs = {},
       .outputs = {{"ct", "ct.mha"},
                   {"photos", "photos/cameras.json"},
                   {"lighting", "photos/lighting.json"},
                   {"truth", "truth.ply"}},
       .make_options = make_options<PhantomStageOptions>},
      {.name = "shade",
       .version = 4,
       .summary = "read laparoscopy frames or a video as shading: depth, normals, and a surface",
       .inputs =
           {{"frames", InputKind::frames,
             "a frame (PNG, JPEG, EXR), a folder of frames, or a video"},
            {"intrinsics", InputKind::lenses,
             "the laparoscope: OpenCV calibration YAML, JSON, cameras.json, COLMAP folder or "
             "transforms.json; else --field-of-view",
             false},
            {"instruments", InputKind::file,
             "mask of the frames' size (PNG), not black = instrument; else found by colour", false},
            {"lamp", InputKind::file,
             "lighting.json of the same endoscope, as stereo writes it: the place and beam of "
             "its lamp, instead of --light-offset and --beam",
             false}},
       .outputs = {{"surface", "surface.ply"},
                   {"lighting", "lighting.json", true},
                   {"shading", "."}},
       .make_options = make_options<ShadeStageOptions>,
       .on_request = true},
      {.name = "stereo",
       .summary = "match the eyes of a stereo endoscope: metric depth, normals, and a surface",
       .inputs = {{"left", InputKind::frames,
                   "the left eye's frame (PNG, JPEG), folder of frames or video; or one file that "
                   "holds both eyes in each frame"},
                  {"right", InputKind::frames, "the right eye's", false},
                  {"calibration", InputKind::lenses,
                   "the two eyes: OpenCV stereo calibration (YAML, JSON), cameras.json of two "
                   "cameras, or a folder of texts (*left.intrinsics*, *l2r* …)"}},
       .outputs = {{"surface", "surface.ply"},
                   {"lighting", "lighting.json", true},
                   {"stereo_depth", "."}},
       .make_options = make_options<StereoStageOptions>,
       .on_request = true},
      {.name = "fuse",
       .summary = "fuse depth maps from known poses into one coloured surface",
       .inputs = {{.name = "depth",
                   .kind = InputKind::frames,
                   .help = "depth maps (EXR, planar z), or folders of them as shade and stereo "
                           "write them",
                   .many = true},
                  {.name = "poses",
                   .kind = InputKind::posed,
                   .help = "the depth maps' cameras: cameras.json, COLMAP folder or "
                           "transforms.json; their images colour the surface"},
                  {.name = "pictures",
                   .kind = InputKind::frames,
                   .help = "folder of the cameras' images, when they lie elsewhere",
                   .required = false}},
       .outputs = {{"surface", "surface.ply"}},
       .make_options = make_options<FuseStageOptions>,
       .single_file = true,
       .on_request = true},
      {.name = "repair",
       .summary = "make an outward manifold of a surface as programs export it",
       .inputs = {{"mesh", InputKind::mesh, "the surface to repair"}},
       .outputs = {{"surface", "surface.ply"}},
       .make_options = make_options<RepairStageOptions>,
       .single_file = true,
       .on_request = true},
      {.name = "isosurface",
       .version = 2,
       .summary = "turn a CT, or one label of a mask, into a closed surface",
       .inputs = {{"ct", InputKind::volume, "CT: NIfTI, MetaImage, NRRD, VTI or DICOM folder", true,
                   "mask"},
                  {"mask", InputKind::volume, "label mask; the surface of one label is taken",
                   false},
                  {"label_names", InputKind::file,
                   "names of the mask's labels: a text as ITK-SNAP or 3D Slicer writes it", false}},
       .outputs = {{"surface", "surface.ply"}},
       .make_options = make_options<IsosurfaceStageOptions>,
       .single_file = true},
      {.name = "decimate",
       .version = 4,
       .summary = "reduce a surface to the coarse proxy that the player deforms",
       .inputs = {surface},
       .outputs = {{"proxy", "proxy.ply"}},
       .make_options = make_options<DecimateStageOptions>,
       .single_file = true},
      {.name = "mechanics",
       .version = 3,
       .summary = "give a proxy its springs, masses and anchors",
       .inputs = {{"proxy", InputKind::mesh, "the proxy"}},
       .outputs = {{"mechanics", "mechanics.json"}},
       .make_options = make_options<MechanicsStageOptions>,
       .single_file = true},
      {.name = "place",
       .version = 6,
       .summary = "place virtual cameras round a surface or inside a viewing cone",
       .inputs = {surface},
       .outputs = {{"cameras", "cameras.json"}, {"vpm", "vpm.ply"}},
       .make_options = make_options<PlaceStageOptions>},
      {.name = "register",
       .version = 5,
       .summary = "find a photograph's pose on the surface, with a verdict",
       .inputs = {surface,
                  {.name = "photo",
                   .kind = InputKind::file,
                   .help =
                       "photographs, PNG or JPEG, or one video: each frame starts from the last",
                   .unless = "unposed",
                   .many = true},
                  {.name = "intrinsics",
                   .kind = InputKind::lenses,
                   .help =
                       "the lens: OpenCV calibration YAML, JSON, cameras.json, COLMAP folder or "
                       "transforms.json",
                   .unless = "unposed"},
                  {.name = "init",
                   .kind = InputKind::lenses,
                   .help = "poses to start from: pose.json, COLMAP folder or transforms.json; else "
                           "a search all round",
                   .required = false},
                  {.name = "photo_mask",
                   .kind = InputKind::file,
                   .help = "picture of the photos' size, black where they don't count",
                   .required = false,
                   .flag = "mask"},
                  {.name = "pairs",
                   .kind = InputKind::file,
                   .help = "text with lines 'x y z u v': surface points in mm and their pixels",
                   .required = false},
                  {.name = "unposed",
                   .kind = InputKind::photos,
                   .help = "instead of photos and intrinsics: a cameras.json with images",
                   .required = false}},
       .outputs = {{"photos", "pose.json"}},
       .make_options = make_options<RegisterStageOptions>,
       .single_file = true},
      {.name = "capture",
       .version = 10,
       .summary = "bake depth, colour and microstructure for each virtual camera",
       .inputs = {surface,
                  {"proxy", InputKind::mesh, "the proxy"},
                  {"cameras", InputKind::cameras, "virtual cameras, as place writes them"},
                  {.name = "photos",
                   .kind = InputKind::photos,
                   .help = "posed photographs: a cameras.json with images",
                   .required = false,
                   .made_from = "unposed"},
                  {.name = "lighting",
                   .kind = InputKind::file,
                   .help = "the light that the colours were taken in (JSON, see 'organbake schema "
                           "lighting'): the player then lights the pushed skin anew",
                   .required = false},
                  {.name = "exemplar",
                   .kind = InputKind::file,
                   .help = "photograph (PNG, JPEG) of the tissue that a surface without colours "
                           "gets; the material then gives its gloss alone",
                   .required = false},
                  {.name = "exemplar_mask",
                   .kind = InputKind::file,
                   .help = "picture of the exemplar's size, black where it is another tissue",
                   .required = false}},
       .outputs = {{"maps", "."}},
       .make_options = make_options<CaptureStageOptions>},
  };
}

}  // namespace

std::string input_of_many(const StageInput& input, std::size_t index,
                          const std::filesystem::path& path) {
  constexpr std::size_t kDigits = 4;  // names sort as they were given
  return input.name + " " + padded(index, kDigits) + " " + path.filename().string();
}

const std::vector<Stage>& all_stages() {
  static const std::vector<Stage> stages = describe();
  return stages;
}

const Stage* find_stage(const std::string& name) {
  for (const Stage& stage : all_stages()) {
    if (stage.name == name) return &stage;
  }
  return nullptr;
}

}  // namespace organbake
