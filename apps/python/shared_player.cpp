// SPDX-License-Identifier: Apache-2.0
#include "player_bindings.h"

#include <cstring>

#include "organbake/core/error.h"
#include "organbake/truth/truth_recorder.h"

namespace organbake {

namespace {

// What was asked for; the tracker needs its own for the next picture's flow.
void copy_layers(const PixelTruth& from, const LayerSet& layers, PixelTruth& to) {
  to.width = from.width, to.height = from.height;
  if (layers.depth) to.depth_mm = from.depth_mm;
  if (layers.mask) to.label = from.label;
  if (layers.normals) to.normal = from.normal;
  if (layers.id || layers.weight) to.bound = from.bound;
  if (layers.id) to.organ = from.organ;
}

}  // namespace

SharedPlayer::SharedPlayer(const std::vector<std::filesystem::path>& bundles,
                           const DeformOptions& options, std::optional<DrawnLight> light,
                           std::optional<int> threads)
    : light_(light), time_step_s_(options.time_step_s) {
  options.check();
  if (threads && *threads < 1)
    throw UsageError("threads is " + std::to_string(*threads) + "; it must be 1 or more");
  alone_ = threads == 1;
  if (threads && !alone_) threads_.emplace(*threads);
  player_ = std::make_unique<Player>(bundles, options);
  player_->light_for(light_);  // throws for one in which the organs cannot be shown
}

Player& SharedPlayer::open() {
  if (!player_) throw UsageError("the player is closed; load the bundle anew");
  return *player_;
}

StepReport SharedPlayer::step(const std::vector<Instrument>& instruments) {
  const Turn turn(*this);
  StepReport report = open().step(instruments);
  time_s_ += time_step_s_;
  instruments_ = instruments;
  for (std::size_t i = 0; i < instruments_.size(); ++i)
    instruments_[i].position_mm = report.tip_position_mm[i];
  return report;
}

void SharedPlayer::place_tools(const std::vector<Instrument>& instruments) {
  check_instruments(instruments);
  const Turn turn(*this);
  open();
  instruments_ = instruments;
}

void SharedPlayer::reset(std::optional<double> stiffness) {
  const Turn turn(*this);
  stiffness ? open().set_stiffness(*stiffness) : open().reset();
  instruments_.clear();
  tracker_.reset();
}

SharedPlayer::State SharedPlayer::save_state() {
  const Turn turn(*this);
  return {open().save_state(), instruments_, time_s_};
}

void SharedPlayer::restore_state(const State& state) {
  const Turn turn(*this);
  open().restore_state(state.moment);
  instruments_ = state.instruments;
  time_s_ = state.time_s;
  tracker_.reset();
}

void SharedPlayer::close() {
  const Turn turn(*this);
  threads_.reset();
  batches_.clear();
  player_.reset();
  tools_.reset();
  tracker_.reset();
  frame_ = {};
}

// As the lens and the camera show what is drawn of a view. item: which of the pictures with one
// seed, so that two eyes have noise of their own.
void SharedPlayer::take_picture(const View& view, const DrawOptions& options,
                                const TakenPicture& how, std::uint64_t item, Frame& drawn,
                                Rgb8Image& seen) {
  player_->draw(view, options, drawn);
  if (how.lens) {
    how.lens->show({drawn, view, rest_bounds(*player_)}, seen);
  } else {
    seen = drawn.color;
  }
  expose(how.gain, how.noise, how.seed, item, seen);
}

DrawnPicture SharedPlayer::draw(View view, const TakenPicture& how, std::uint8_t* pixels) {
  const Turn turn(*this);
  Player& player = open();
  const LayerSet& layers = how.layers;
  DrawOptions options;
  options.light = how.light ? how.light : light_;
  options.keep_bound = layers.any();
  options.bind_as_drawn = !layers.flow && !layers.normals && !layers.id;
  if (how.lens) view.camera.intrinsics = how.lens->pinhole(), how.lens->prepare(options);
  if (how.tools) {
    if (!tools_) tools_.emplace(player);
    options.solids = tools_->solids(instruments_, view, time_s_);
  }
  DrawnPicture picture;
  picture.layers = layers;
  if (how.stereo_mm) {
    DrawOptions right = options;
    right.keep_bound = false;
    take_picture(right_eye(view, *how.stereo_mm), right, how, 1, frame_, picture.right);
  }
  take_picture(view, options, how, 0, frame_, picture.color);
  player.load_ahead();  // the next views won't wait
  if (pixels) {
    std::memcpy(pixels, picture.color.pixels.data(), picture.color.pixels.size());
    picture.color.pixels = {};
  }
  if (!layers.any()) return picture;
  if (!tracker_ || !(tracker_->layers() == layers) || lens_ != how.lens) tracker_.emplace(layers);
  lens_ = how.lens;
  tracker_->advance(player, view, options.solids, frame_);
  picture.has_flow = layers.flow && tracker_->has_before();
  if (picture.has_flow) {
    tracker_->find_backward(picture.backward);
    tracker_->find_forward(picture.forward);
  }
  if (!how.lens) {
    copy_layers(tracker_->now(), layers, picture.truth);
    return picture;
  }
  PixelTruth seen;
  how.lens->show(tracker_->now(), seen);
  copy_layers(seen, layers, picture.truth);
  if (picture.has_flow) {
    Flow drawn = std::move(picture.backward);
    how.lens->show(drawn, tracker_->now(), picture.backward = {});
    drawn = std::move(picture.forward);
    how.lens->show(drawn, tracker_->before(), picture.forward = {});
  }
  return picture;
}

void SharedPlayer::draw_many(const StateBatch& states, const std::vector<View>& views,
                             std::size_t organ, const BatchPlanes& planes) {
  const Turn turn(*this);
  const Player& player = open();
  if (player.is_cut(organ)) batches_.erase(organ);
  std::unique_ptr<BatchDrawing>& batch = batches_[organ];
  if (!batch) batch = std::make_unique<BatchDrawing>(player, organ);
  batch->draw(states, views, player.light_for(light_), planes);
}

}  // namespace organbake
