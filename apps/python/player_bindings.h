// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the module organplay is made of: the player that threads share, what Python tells of tips,
// and pictures whose arrays are over C++'s memory.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/one_thread.h"
#include "organbake/core/parallel.h"
#include "organbake/instruments/instrument.h"
#include "organbake/player/embedded_player.h"
#include "organbake/player/held_tools.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/truth/batch_drawing.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// One picture and what was asked for beside it.
struct DrawnPicture {
  Rgb8Image color;
  LayerSet layers;
  PixelTruth truth;
  bool has_flow = false;
  Flow backward, forward;  // from this picture to the last one, and from that to this
  Rgb8Image right;         // of the second eye; empty without one
  // The caller's own array, which holds the colours then, or None; set with the interpreter's lock.
  pybind11::object drawn_into;
};

// How a picture is taken.
struct TakenPicture {
  LayerSet layers;
  bool tools = true;                        // show those of the last step
  std::shared_ptr<const LensPicture> lens;  // of a scope; null: a pinhole
  std::optional<DrawnLight> light;          // nothing: the player's
  double gain = 1, noise = 0;               // expose()
  std::uint64_t seed = 0;                   // of the noise
  std::optional<double> stereo_mm;          // a second eye so far to the right
};

// A player that several threads may call, one after the other: without the interpreter's lock,
// which no call needs. Throws what Player throws, and UsageError once it was closed.
class SharedPlayer {
 public:
  SharedPlayer(const std::vector<std::filesystem::path>& bundles, const DeformOptions& options,
               std::optional<DrawnLight> light, std::optional<int> threads);

  // With the tools that were held.
  struct State {
    Player::State moment;
    std::vector<Instrument> instruments;
    double time_s = 0;
  };
  State save_state();
  void restore_state(const State& state);
  StepReport step(const std::vector<Instrument>& instruments);
  void place_tools(const std::vector<Instrument>& instruments);  // for pictures alone
  void reset(std::optional<double> stiffness);
  void close();
  // `pixels`: room for the picture in the caller's memory instead of the result's own, or nullptr.
  DrawnPicture draw(View view, const TakenPicture& how, std::uint8_t* pixels);
  // Of one organ alone.
  void draw_many(const StateBatch& states, const std::vector<View>& views, std::size_t organ,
                 const BatchPlanes& planes);
  // work(player), called with the interpreter's lock held, which it gives back meanwhile. What it
  // returns is a copy.
  template <class Work>
  auto with(const Work& work) {
    const pybind11::gil_scoped_release release;
    const Turn turn(*this);
    return work(open());
  }

 private:
  // One call after the other; of a player with one thread by the caller's own.
  struct Turn {
    explicit Turn(SharedPlayer& player) : lock(player.mutex_) {
      if (player.alone_) alone.emplace();
    }
    std::lock_guard<std::mutex> lock;
    std::optional<OneThread> alone;
  };
  Player& open();  // in a turn
  void take_picture(const View& view, const DrawOptions& options, const TakenPicture& how,
                    std::uint64_t item, Frame& drawn, Rgb8Image& seen);

  std::mutex mutex_;
  std::optional<ThreadLimit> threads_;
  bool alone_ = false;
  std::unique_ptr<Player> player_;
  std::optional<DrawnLight> light_;
  std::vector<Instrument> instruments_;  // of the last step, where they were held
  double time_step_s_, time_s_ = 0;      // passed since it was loaded
  std::optional<HeldTools> tools_;       // once they were drawn
  Frame frame_;
  std::optional<TruthTracker> tracker_;
  std::shared_ptr<const LensPicture> lens_;  // of the last picture with layers
  // Once many were drawn, by organ.
  std::map<std::size_t, std::unique_ptr<BatchDrawing>> batches_;
};

// What Python tells of tips, each for all of them or one by one; numbers: of each_number(), by
// name.
struct TipArguments {
  const pybind11::object &positions_mm, &radius_mm, &axis_mm, &grabs, &cuts, &snips, &opening_mm,
      &pierces, &active;
  const pybind11::kwargs& numbers;

  // Throws UsageError naming the argument.
  std::vector<Instrument> instruments() const;
};

// A method of tips: work(player, instruments, more…), whose further arguments are keywords, too.
template <class Class, class... More, class Result>
void def_with_tips_as(Class& player, const char* name,
                      Result (*work)(SharedPlayer&, const std::vector<Instrument>&, More...),
                      const char* doc, const auto&... more) {
  namespace py = pybind11;
  using Given = const py::object&;
  player.def(
      name,
      [work](SharedPlayer& self, Given positions_mm, Given radius_mm, Given axis_mm, Given grabs,
             Given cuts, Given snips, Given opening_mm, Given pierces, Given active, More... rest,
             const py::kwargs& numbers) {
        const TipArguments tips{positions_mm, radius_mm,  axis_mm, grabs,  cuts,
                                snips,        opening_mm, pierces, active, numbers};
        return work(self, tips.instruments(), rest...);
      },
      py::arg("positions_mm") = py::list(), py::kw_only(), py::arg("radius_mm") = 5.0,
      py::arg("axis_mm") = py::none(), py::arg("grabs") = false, py::arg("cuts") = false,
      py::arg("snips") = false, py::arg("opening_mm") = py::none(), py::arg("pierces") = false,
      py::arg("active") = true, more..., doc);
}
template <class Class>
void def_with_tips(Class& player, const char* name, auto work, const char* doc,
                   const auto&... more) {
  def_with_tips_as(player, name, +work, doc, more...);
}

// "depth,mask", or a list of names; empty: none. Throws TypeError for what is no text.
LayerSet layer_set_from(const pybind11::object& argument);

// organplay.View, organplay.Picture and organplay.Mesh.
void bind_view(pybind11::module_& m);
void bind_picture(pybind11::module_& m);
void bind_mesh(pybind11::module_& m);

// organplay.Step, and the player's method that returns one.
void bind_step(pybind11::module_& m,
               pybind11::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player);

// States that another solver computes: Player's methods for them, and the class Pictures.
void bind_states(pybind11::module_& m,
                 pybind11::class_<SharedPlayer, std::shared_ptr<SharedPlayer>>& player);

}  // namespace organbake
