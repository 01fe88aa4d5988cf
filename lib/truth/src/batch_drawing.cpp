// SPDX-License-Identifier: Apache-2.0
// One thread a picture instead of all threads on each: small pictures have too little in them to
// share out. Pictures go to whoever is free; where flow is asked for, runs of them, each of which
// begins with the picture before its first.
#include "organbake/truth/batch_drawing.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/one_thread.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// What one thread draws with.
struct Desk {
  Warper warper;
  Frame frame;
  OrganState state;
  TruthTracker truth;
  Flow flow;
};

struct Batch {
  const StateBatch& states;
  std::span<const View> views;
  DrawOptions options;
  LayerSet layers;
  const BatchPlanes& planes;

  const View& view(std::size_t i) const { return views.size() == 1 ? views[0] : views[i]; }
  std::size_t pixels() const {
    return std::size_t(views[0].camera.intrinsics.width) * views[0].camera.intrinsics.height;
  }
};

void check(const StateBatch& states, std::size_t points, std::span<const View> views) {
  const std::size_t numbers = std::visit([](const auto& xyz) { return xyz.size(); }, states.xyz_mm);
  if (numbers != 3 * points * states.count) {
    throw UsageError(std::to_string(states.count) + " states of " +
                     (states.of == StateOf::vertices ? "vertices" : "nodes") + " take " +
                     std::to_string(3 * points * states.count) + " numbers; there are " +
                     std::to_string(numbers));
  }
  if (views.size() != 1 && views.size() != states.count) {
    throw UsageError(std::to_string(views.size()) + " views for " + std::to_string(states.count) +
                     " states; there must be one for all, or one for each");
  }
  for (const View& view : views) {
    view.check();
    const Intrinsics &lens = view.camera.intrinsics, &first = views[0].camera.intrinsics;
    if (lens.width != first.width || lens.height != first.height)
      throw UsageError("the views of a batch must be of one size");
  }
}

template <class Number>
void put(const Number* from, std::size_t count, std::size_t picture, auto* to) {
  if (to) std::memcpy(to + picture * count, from, count * sizeof(*to));
}

void put_layers(const Batch& batch, std::size_t i, const TruthTracker& truth, Flow& flow) {
  const std::size_t pixels = batch.pixels();
  const BatchPlanes& to = batch.planes;
  put(truth.now().depth_mm.data(), pixels, i, to.depth_mm);
  put(truth.now().label.data(), pixels, i, to.mask);
  if (to.normals) put(truth.now().normal.data()->data(), 3 * pixels, i, to.normals);
  if (!batch.layers.flow) return;
  if (truth.has_before()) {
    truth.find_backward(flow);
  } else {
    flow.px.assign(pixels, Eigen::Vector2f::Zero());
    flow.seen.assign(pixels, 0);
  }
  put(flow.px.data()->data(), 2 * pixels, i, to.flow_back);
  put(flow.seen.data(), pixels, i, to.flow_seen);
}

}  // namespace

struct BatchDrawing::Impl {
  const Player& player;
  const std::size_t organ;
  StateReader reader;
  std::mutex hiring;
  std::vector<std::unique_ptr<Desk>> free;  // desks that no thread sits at

  Impl(const Player& given, std::size_t number)
      : player(given), organ(number), reader(given.bundle(number)) {}

  std::unique_ptr<Desk> take_desk();
  void pose(const StateBatch& states, std::size_t i, OrganState& state) const;
  void draw_run(const Batch& batch, std::size_t first, std::size_t last, Desk& desk) const;
};

std::unique_ptr<Desk> BatchDrawing::Impl::take_desk() {
  {
    const std::lock_guard lock(hiring);
    if (!free.empty()) {
      std::unique_ptr<Desk> desk = std::move(free.back());
      free.pop_back();
      return desk;
    }
  }
  return std::make_unique<Desk>(
      Desk{player.warper_beside(organ), {}, {}, TruthTracker(LayerSet()), {}});
}

void BatchDrawing::Impl::pose(const StateBatch& states, std::size_t i, OrganState& state) const {
  const std::size_t numbers = 3 * reader.count(states.of);
  try {
    std::visit(
        [&](const auto& xyz) { reader.read(xyz.subspan(i * numbers, numbers), states.of, state); },
        states.xyz_mm);
  } catch (const UsageError& error) {
    throw UsageError("state " + std::to_string(i) + ": " + error.what());
  }
}

void BatchDrawing::Impl::draw_run(const Batch& batch, std::size_t first, std::size_t last,
                                  Desk& desk) const {
  TruthTracker& truth = desk.truth;
  if (!(truth.layers() == batch.layers)) truth = TruthTracker(batch.layers);
  truth.forget();
  const std::size_t begin = batch.layers.flow && first > 0 ? first - 1 : first;
  for (std::size_t i = begin; i < last; ++i) {
    pose(batch.states, i, desk.state);
    desk.warper.draw(desk.state.vertices_mm, batch.view(i), batch.options, desk.frame);
    if (i >= first) put(desk.frame.color.pixels.data(), 3 * batch.pixels(), i, batch.planes.rgb);
    if (!batch.layers.any()) continue;
    const Warper* const drawn = &desk.warper;
    truth.advance({&drawn, 1}, batch.view(i), {}, desk.frame);
    if (i >= first) put_layers(batch, i, truth, desk.flow);
  }
}

BatchDrawing::BatchDrawing(const Player& player, std::size_t organ)
    : impl_(std::make_unique<Impl>(player, organ)) {
  impl_->free.push_back(impl_->take_desk());  // throws now for an organ that is cut
}
BatchDrawing::~BatchDrawing() = default;

void BatchDrawing::draw(const StateBatch& states, std::span<const View> views, DrawnLight light,
                        const BatchPlanes& planes) {
  check(states, impl_->reader.count(states.of), views);
  if (states.count == 0) return;
  Batch batch{states, views, {}, {}, planes};
  batch.layers.depth = planes.depth_mm != nullptr;
  batch.layers.normals = planes.normals != nullptr;
  batch.layers.mask = planes.mask != nullptr;
  batch.layers.flow = planes.flow_back != nullptr;
  batch.options.light = light;
  batch.options.keep_bound = batch.layers.any();
  batch.options.bind_as_drawn = !batch.layers.flow && !batch.layers.normals;
  const auto threads = static_cast<std::size_t>(allowed_threads());
  const std::size_t runs = batch.layers.flow ? std::min(states.count, threads) : states.count,
                    shared_from = runs - runs % threads;
  parallel_in_order(runs, [&](std::size_t run) {
    std::unique_ptr<Desk> desk = impl_->take_desk();
    const auto draw = [&] {
      impl_->draw_run(batch, run * states.count / runs, (run + 1) * states.count / runs, *desk);
    };
    // All threads have pictures of their own, but for the last few, which they share; while one
    // waits for parts of its picture it begins no other.
    if (run < shared_from) {
      const OneThread alone;
      draw();
    } else {
      isolated(draw);
    }
    const std::lock_guard lock(impl_->hiring);
    impl_->free.push_back(std::move(desk));
  });
}

}  // namespace organbake
