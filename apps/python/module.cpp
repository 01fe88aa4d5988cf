// SPDX-License-Identifier: Apache-2.0
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <pybind11/stl.h>

#include <filesystem>
#include <new>

#include "array_arguments.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/player/skin_point.h"
#include "organbake/truth/truth_recorder.h"
#include "player_bindings.h"

namespace organbake {
namespace py = pybind11;
namespace {

std::vector<std::filesystem::path> paths_from(const py::object& bundles) {
  const py::object fspath = py::module_::import("os").attr("fspath");
  const auto one = [&](const py::handle& given) {
    try {
      return std::filesystem::path(py::cast<std::string>(fspath(given)));
    } catch (const py::error_already_set&) {
    } catch (const py::cast_error&) {
    }
    throw UsageError("bundles must be a path, or a list of paths");
  };
  if (py::isinstance<py::list>(bundles) || py::isinstance<py::tuple>(bundles)) {
    std::vector<std::filesystem::path> paths;
    for (const py::handle& given : bundles) paths.push_back(one(given));
    if (paths.empty()) throw UsageError("bundles is empty; a player needs a bundle");
    return paths;
  }
  return {one(bundles)};
}

std::optional<DrawnLight> light_from(const std::optional<std::string>& name) {
  std::optional<DrawnLight> light;
  if (name && !(light = drawn_light(*name)))
    throw UsageError("light '" + *name + "' is none; take " + all_lights());
  return light;
}

std::shared_ptr<SharedPlayer> load(const py::object& bundles, double time_step_s,
                                   const std::optional<std::string>& solver,
                                   const std::optional<std::string>& light,
                                   std::optional<int> threads) {
  const auto paths = paths_from(bundles);
  DeformOptions options;
  options.time_step_s = time_step_s;
  if (solver && !(options.solver = tissue_solver(*solver)))
    throw UsageError("solver '" + *solver + "' is none; take springs or fem");
  const std::optional<DrawnLight> drawn = light_from(light);
  const py::gil_scoped_release release;
  return std::make_shared<SharedPlayer>(paths, options, drawn, threads);
}

// A scope's preset, and its lens before pictures of the size that was last asked for.
class Scope {
 public:
  explicit Scope(const py::object& file) {
    name_ = paths_from(file).front().string();
    lens_ = read_scope_lens(name_);
  }
  std::shared_ptr<const LensPicture> lens(int width, int height) {
    if (!last_ || last_->lens().width != width || last_->lens().height != height)
      last_ = std::make_shared<const LensPicture>(lens_.in_size(width, height), name_);
    return last_;
  }
  const Intrinsics& intrinsics() const { return lens_.intrinsics; }

 private:
  std::string name_;
  ScopeLens lens_;
  std::shared_ptr<const LensPicture> last_;
};

double number_within(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw UsageError(std::string(name) + " is " + to_text(value, 6) + "; it must be " +
                     to_text(low, 6) + " to " + to_text(high, 6));
  return value;
}

DrawnPicture draw(SharedPlayer& player, const View& view, const py::object& layers, bool tools,
                  const py::object& out, Scope* scope, const std::optional<std::string>& light,
                  double gain, double noise, std::uint64_t seed, std::optional<double> stereo_mm) {
  view.check();
  TakenPicture how;
  how.layers = layer_set_from(layers);
  how.tools = tools;
  how.light = light_from(light);
  how.gain = number_within("gain", gain, 0.01, 100);
  how.noise = number_within("noise", noise, 0, 255);
  how.seed = seed;
  how.stereo_mm = stereo_mm;
  if (stereo_mm) check_baseline(*stereo_mm);
  if (scope) how.lens = scope->lens(view.camera.intrinsics.width, view.camera.intrinsics.height);
  const py::ssize_t height = view.camera.intrinsics.height, width = view.camera.intrinsics.width;
  py::object room = out;
  std::uint8_t* const pixels =
      out.is_none() ? nullptr : room_in<std::uint8_t>(room, "out", {height, width, 3});
  DrawnPicture picture;
  {
    const py::gil_scoped_release release;
    picture = player.draw(view, how, pixels);
  }
  picture.drawn_into = out;
  return picture;
}

void bind_scope(py::module_& m) {
  py::class_<Scope>(m, "Scope",
                    "A scope's lens and camera, as organplay --scope takes them: Player.draw() "
                    "shows what it makes of the organ.")
      .def(py::init<const py::object&>(), py::arg("file"),
           "A preset (organbake schema scope-lens), or cameras.json. Raises OSError or ValueError.")
      .def_property_readonly(
          "size",
          [](const Scope& s) {
            return py::make_tuple(s.intrinsics().width, s.intrinsics().height);
          },
          "Width and height of its own pictures, px; others show the middle of those.");
}

void bind_player(py::module_& m) {
  const auto released = py::call_guard<py::gil_scoped_release>();
  py::class_<SharedPlayer, std::shared_ptr<SharedPlayer>> player(
      m, "Player",
      "A baked organ, or several that push each other, to be poked and drawn. World millimetres "
      "(LPS). Threads may share one: their calls follow each other, without the interpreter's "
      "lock.");
  bind_step(m, player);
  bind_states(m, player);
  player
      .def(py::init(&load), py::arg("bundles"), py::kw_only(), py::arg("time_step_s") = 1.0 / 60,
           py::arg("solver") = py::none(), py::arg("light") = py::none(),
           py::arg("threads") = py::none(),
           "bundles: a folder made by organbake bake, or a list of them. solver: springs or fem; "
           "None: fem where every organ has tetrahedra, else springs. "
           "light: baked, world or scope; None: what the organs are made for. threads: 1: each "
           "call's own does all its work; more: as long as the player is open no more than so "
           "many work for this process's players; None: as many as there are processors. Raises "
           "OSError for a file that is missing, ValueError "
           "for one that is damaged.")
      .def("reset", &SharedPlayer::reset, py::arg("stiffness") = py::none(), released,
           "Back to rest; flow begins anew. stiffness: of the tissue from now on, in multiples of "
           "what was baked, 0.05 to 20; None: as it is.")
      .def("close", &SharedPlayer::close, released,
           "Frees the bundle; later calls raise ValueError. Arrays stay good.")
      .def(
          "orbit",
          [](SharedPlayer& self, double azimuth_rad, double elevation_rad, double distance,
             int width, int height) {
            OrbitPose pose;
            pose.azimuth_rad = azimuth_rad, pose.elevation_rad = elevation_rad;
            pose.distance = distance;
            return self.with([&](const Player& player) {
              return orbit_view(player.bundle().cameras, pose, width, height);
            });
          },
          py::arg("azimuth_rad") = 0.0, py::arg("elevation_rad") = 0.0, py::arg("distance") = 1.0,
          py::kw_only(), py::arg("width") = 640, py::arg("height") = 480,
          "A View round the first organ's vertical axis from its first virtual camera; distance in "
          "multiples of that camera's.")
      .def(
          "draw", &draw, py::arg("view"), py::arg("layers") = "", py::kw_only(),
          py::arg("tools") = true, py::arg("out") = py::none(),
          py::arg("scope").none(true) = static_cast<Scope*>(nullptr), py::arg("light") = py::none(),
          py::arg("gain") = 1.0, py::arg("noise") = 0.0, py::arg("seed") = 0,
          py::arg("stereo_mm") = py::none(),
          "Draws a Picture. layers: of depth, flow, normals, mask, id, weight, comma-separated or "
          "a list, or all. Flow is to the last picture that was drawn with the same layers. tools: "
          "show the tips of the last step, or those of place_tools(). out: a uint8 array (h, w, 3) "
          "to draw into. scope: a Scope, whose lens takes the place of the view's. light: baked, "
          "world or scope; None: the player's. gain: multiplies the linear light, 0.01 to 100; "
          "noise: its standard deviation in levels of 255, drawn from seed. stereo_mm: draws "
          "right_rgb, too, from an eye so far to the right.")
      .def(
          "proxy_mm",
          [](SharedPlayer& self, std::size_t organ) {
            return rows_of(
                self.with([&](const Player& player) { return player.proxy_positions(organ); }));
          },
          py::arg("organ") = 0, "(n, 3): the vertices of an organ's proxy as they lie now.")
      .def(
          "proxy_faces",
          [](SharedPlayer& self, std::size_t organ) {
            return rows_of(self.with(
                [&](const Player& player) { return player.bundle_now(organ).proxy.faces; }));
          },
          py::arg("organ") = 0, "(m, 3) uint32: its faces, counter-clockwise from outside.")
      .def(
          "skin_point",
          [](SharedPlayer& self, const py::object& direction) {
            const Eigen::Vector3d along = vector_from(direction, "direction");
            if (!along.allFinite() || !(along.squaredNorm() > 0))
              throw UsageError("a direction needs three finite numbers that are not all zero");
            const Eigen::Vector3d point = self.with(
                [&](const Player& player) { return skin_place(player.bundle(), along).skin_mm; });
            return py::make_tuple(point.x(), point.y(), point.z());
          },
          py::arg("direction"),
          "Where a line from the first organ's centre along a direction leaves its skin at rest.")
      .def_property_readonly(
          "organ_count",
          [](SharedPlayer& self) {
            return self.with([](const Player& player) { return player.organ_count(); });
          },
          "How many organs were loaded.");
}

}  // namespace

void bind_organplay(py::module_& m) {
  m.doc() =
      "Pokes and draws organs baked by organbake, on the CPU, with the truth beside every picture.";
  py::register_exception_translator(&translate_error);
  m.attr("__version__") = kVersion;
  bind_view(m);
  bind_scope(m);
  bind_picture(m);
  bind_mesh(m);
  bind_player(m);
}

}  // namespace organbake

PYBIND11_MODULE(_organplay, m) {
#ifdef __AVX2__
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    throw pybind11::import_error("organplay needs a processor with AVX2 and FMA");
#endif
  organbake::bind_organplay(m);
}
