// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>
#include <utility>

#include "exchange.h"
#include "organbake/registration/register_photo.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {
namespace py = pybind11;
namespace {

RegisteredPhoto find_pose(const py::object& vertices, const py::object& faces,
                          const py::object& image, const py::object& intrinsics,
                          const py::object& start, const py::object& mask, const std::string& light,
                          const std::string& similarity, bool free_focal, bool closed_outline) {
  TriangleMesh mesh = mesh_from(vertices, faces);
  PhotoToRegister photo;
  photo.image = picture_from(image, "image");
  photo.intrinsics = lens_from(intrinsics, photo.image.width, photo.image.height);
  photo.mask = mask_from(mask, "mask");
  if (!start.is_none()) photo.start = pose_from(start, "start");
  RegistrationOptions options;
  options.light = chosen<LightModel>("light", light,
                                     {{"auto", LightModel::automatic},
                                      {"camera", LightModel::camera},
                                      {"beam", LightModel::beam},
                                      {"estimated", LightModel::estimated}});
  options.similarity = chosen<Similarity>(
      "similarity", similarity,
      {{"radiance", Similarity::radiance}, {"silhouette", Similarity::silhouette}});
  options.free_focal = free_focal;
  options.check();
  return run_released([&](const RunContext& context) {
    const RegisteredSurface surface(
        std::move(mesh), closed_outline ? MeshBorders::outlines : MeshBorders::unknown_beyond);
    return register_photo(surface, photo, options, context);
  });
}

void bind_register(py::module_& m) {
  using Found = RegisteredPhoto;
  const auto figure = [](double PoseQuality::*member) {
    return [member](const Found& f) { return f.quality.*member; };
  };
  py::class_<Found>(m, "Pose", "Where a photograph was taken from, and what that is worth.")
      .def_property_readonly(
          "camera_from_world", [](const Found& f) { return matrix_of(f.camera.camera_from_world); },
          "(4, 4), mm.")
      .def_property_readonly(
          "verdict", [](const Found& f) { return name_of(f.quality.verdict); },
          "ok, doubtful or failed; only an ok pose may be relied on.")
      .def_property_readonly(
          "reason", [](const Found& f) { return f.quality.reason; }, "Why it is not ok.")
      .def_property_readonly("light", [](const Found& f) { return name_of(f.light); })
      .def_property_readonly("correlation", figure(&PoseQuality::correlation))
      .def_property_readonly("visible_share", figure(&PoseQuality::visible_share))
      .def_property_readonly(
          "outline_share", figure(&PoseQuality::outline_share),
          "Of the outline that could be looked at, what the photograph confirms.")
      .def_property_readonly("surface_sd_mm", figure(&PoseQuality::surface_sd_mm),
                             "Standard deviation of the surface's points: the expected error.")
      .def_property_readonly("focal_scale", figure(&PoseQuality::focal_scale));
  m.def("register", &find_pose, py::arg("vertices_mm"), py::arg("faces"), py::arg("image"),
        py::arg("intrinsics"), py::kw_only(), py::arg("start") = py::none(),
        py::arg("mask") = py::none(), py::arg("light") = "auto", py::arg("similarity") = "radiance",
        py::arg("free_focal") = false, py::arg("closed_outline") = false,
        "Aligns a photograph, (h, w, 3) uint8, with a surface. intrinsics: fx, fy, cx, cy, perhaps "
        "with k1, k2, p1, p2, k3. start: camera_from_world, (4, 4); None: sought all round. mask: "
        "(h, w), 0 where the photograph does not count. Returns a Pose; not finding one is no "
        "error: its verdict says so.");
}

struct ShadedPicture {
  PreparedFrame frame;
  FrameDepth depth;
};

ShadedPicture shade(const py::object& image, const py::object& intrinsics, double field_of_view_rad,
                    double range_mm, double albedo, double texture, double beam_exponent,
                    bool masks, bool piecewise_albedo, const py::object& instruments) {
  Rgb8Image picture = picture_from(image, "image");
  const int width = picture.width, height = picture.height;
  const Intrinsics lens = intrinsics.is_none() ? assumed_camera(width, height, field_of_view_rad)
                                               : lens_from(intrinsics, width, height);
  const Rgb8Image given = mask_from(instruments, "instruments");
  if (!given.pixels.empty() && (given.width != width || given.height != height))
    throw UsageError("instruments has " + std::to_string(given.width) + " × " +
                     std::to_string(given.height) + " pixels, image " + std::to_string(width) +
                     " × " + std::to_string(height));
  Mask tools(given.width, given.height);
  for (std::size_t i = 0; i < tools.size(); ++i) tools.values[i] = given.pixels[3 * i];
  ShadingOptions options;
  options.range_mm = range_mm, options.albedo = albedo;
  options.laparoscope.texture = texture, options.laparoscope.beam_exponent = beam_exponent;
  options.check();
  FrameOptions frame_options;
  frame_options.masks = masks, frame_options.piecewise_albedo = piecewise_albedo;
  frame_options.check();
  return run_released([&](const RunContext&) {
    ShadedPicture shaded;
    shaded.frame = prepare_frame(StoredPicture(std::move(picture)), lens, frame_options,
                                 {.instruments = given.pixels.empty() ? nullptr : &tools});
    shaded.depth = shade_frame(shaded.frame, options);
    return shaded;
  });
}

void bind_shade(py::module_& m) {
  using Shaded = ShadedPicture;
  const auto shape = [](const Shaded& s) {
    return std::vector<py::ssize_t>{s.frame.tissue.height, s.frame.tissue.width};
  };
  py::class_<Shaded>(m, "Shaded", "The depth of a picture; planes are (h, w), top row first.")
      .def_property_readonly(
          "depth",
          [shape](const Shaded& s) { return array_of<float>(s.depth.depth.values, shape(s)); },
          "float32: planar z, mm or of median 1 (see metric); +inf where there is no tissue.")
      .def_property_readonly(
          "normals",
          [](const Shaded& s) {
            return array_of<float>(s.depth.normals,
                                   {s.frame.tissue.height, s.frame.tissue.width, 3});
          },
          "(h, w, 3) float32, camera axes, unit.")
      .def_property_readonly(
          "confidence",
          [shape](const Shaded& s) { return array_of<float>(s.depth.confidence.values, shape(s)); },
          "float32, 0 to 1.")
      .def_property_readonly(
          "tissue",
          [shape](const Shaded& s) {
            return array_of<std::uint8_t>(s.frame.tissue.values, shape(s)).attr("astype")("bool");
          },
          "bool: where there is depth.")
      .def_property_readonly(
          "intrinsics",
          [](const Shaded& s) {
            const Intrinsics& k = s.frame.camera;
            return py::make_tuple(k.fx, k.fy, k.cx, k.cy);
          },
          "Of the planes: the distortion is taken out.")
      .def_property_readonly("metric", [](const Shaded& s) { return s.depth.metric; })
      .def_property_readonly(
          "verdict", [](const Shaded& s) { return name_of(s.depth.quality.verdict); },
          "ok, doubtful or failed.")
      .def_property_readonly("reason", [](const Shaded& s) { return s.depth.quality.reason; })
      .def_property_readonly(
          "support", [](const Shaded& s) { return s.depth.quality.support; },
          "0 to 1: the share of the relief that is kept.");
  m.def("shade", &shade, py::arg("image"), py::arg("intrinsics") = py::none(), py::kw_only(),
        py::arg("field_of_view_rad") = 1.2217304763960306, py::arg("range_mm") = 0.0,
        py::arg("albedo") = 0.0, py::arg("texture") = 0.03, py::arg("beam_exponent") = 0.0,
        py::arg("masks") = true, py::arg("piecewise_albedo") = true,
        py::arg("instruments") = py::none(),
        "The shape of what a laparoscope's picture, (h, w, 3) uint8, shows, from its shading. "
        "intrinsics: as of register; None: a field of view of so many radians across. range_mm: "
        "the tissue's median range, or albedo: either makes the depth metric. instruments: (h, "
        "w), not 0 where there are some; None: they are looked for. Returns a Shaded.");
}

}  // namespace

void bind_photos(py::module_& m) {
  bind_register(m);
  bind_shade(m);
}

}  // namespace organbake
