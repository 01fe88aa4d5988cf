// SPDX-License-Identifier: GPL-3.0-or-later
// Opens a clip, whatever it comes as, and drives its frames through a stage's steps.
#include "stages/shared/clip_source.h"

#include <tbb/parallel_pipeline.h>

#include <cmath>
#include <set>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/lens_files.h"
#include "organbake/formats/photo.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Next = FrameSelection::NextFrame;

std::string size_text(PixelSize size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

// What tells a folder's frames apart: a.png is 'a', and an a.jpg beside it 'a.jpg'.
std::vector<std::string> names_of(const std::vector<fs::path>& files) {
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const fs::path& file : files) {
    const std::string stem = file.stem().string();
    names.push_back(taken.insert(stem).second ? stem : file.filename().string());
  }
  return names;
}

// The frames of a folder in the order of the numbers in their names.
Next pictures_in(std::vector<fs::path> files) {
  return [names = names_of(files), files = std::move(files),
          at = std::size_t{0}](StoredPicture& picture) mutable {
    if (at == files.size()) return false;
    try {
      picture = read_picture(files[at]);
      picture.name = names[at];
    } catch (const Error& error) {
      throw BadDataError("frame " + std::to_string(at) + ": " + error.what());
    }
    ++at;
    return true;
  };
}

Next stored_frames(const fs::path& path) {
  if (fs::is_directory(path)) {
    std::vector<fs::path> files;
    for (const fs::path& file : list_numbered_files(path))
      if (is_frame_name(file)) files.push_back(path / file);
    if (files.empty()) throw BadDataError(path, "holds no PNG, JPEG or EXR frames");
    return pictures_in(std::move(files));
  }
  if (is_frame_name(path)) return pictures_in({path});
  auto video = std::make_shared<VideoReader>(path);
  return [video](StoredPicture& picture) { return video->next(picture); };
}

// The first frame again, then the others.
Next with_first(StoredPicture first, Next others) {
  return [first = std::move(first), others = std::move(others),
          given = false](StoredPicture& picture) mutable {
    if (given) return others(picture);
    given = true;
    picture = std::move(first);
    return true;
  };
}

// Each frame has the size of the first.
Next of_one_size(Next next) {
  return [next = std::move(next), size = PixelSize(),
          at = std::size_t{0}](StoredPicture& picture) mutable {
    if (!next(picture)) return false;
    const PixelSize now{picture.color.width, picture.color.height};
    if (at == 0) size = now;
    if (now != size)
      throw BadDataError("frame " + std::to_string(at) + ": is " + size_text(now) +
                         ", the frames before are " + size_text(size));
    ++at;
    return true;
  };
}

// Of a lens that tells no size, or the one that both have: squeezed pixels show in its focal
// lengths.
bool is_squeezed(const Intrinsics& lens, double pixel_aspect) {
  const double ratio = std::log(lens.fx / lens.fy);
  return std::abs(ratio + std::log(pixel_aspect)) < std::abs(ratio);
}

struct Lens {
  std::optional<Intrinsics> camera;
  bool of_stored_pixels = false;
};

// The lens that belongs to the frames' pixels, upright or as they are stored.
Lens fitting_lens(const StoredPicture& first, const fs::path& frames, const fs::path* path) {
  if (!path) return {};
  const PixelSize stored{first.color.width, first.color.height}, size = upright_size(first);
  const std::string name = frames.filename().string();
  const Intrinsics lens = read_intrinsics(*path, name, size.width, size.height);
  const PixelSize of_lens{lens.width, lens.height};
  if (of_lens != size) return {lens, of_lens == stored};
  if (stored == size || !is_squeezed(lens, first.pixel_aspect)) return {lens, false};
  return {read_intrinsics(*path, name, stored.width, stored.height), true};
}

Lens lens_for(const StoredPicture& first, const fs::path& frames, const fs::path* path,
              const RunContext& context) {
  Lens lens = fitting_lens(first, frames, path);
  if (!lens.camera) return lens;
  const PixelSize size = lens.of_stored_pixels ? PixelSize{first.color.width, first.color.height}
                                               : upright_size(first);
  check_lens_of_picture(*lens.camera, size.width, size.height, *path);
  if (const std::string told = told_of_fisheye(*lens.camera); !told.empty()) context.info(told);
  return lens;
}

void tell(const StoredPicture& first, bool as_stored, const RunContext& context) {
  const PixelSize stored{first.color.width, first.color.height}, size = upright_size(first);
  if (stored == size && first.turn == Turn::none) return;
  std::string tags;
  if (first.turn != Turn::none) tags = "a turn to upright";
  const std::string aspect = to_text(first.pixel_aspect, 3);
  if (aspect != to_text(1.0, 3))
    tags += (tags.empty() ? "" : " and ") + ("pixels " + aspect) + " times as wide as high";
  const std::string frames = "the frames are stored as " + size_text(stored) + " with " + tags;
  context.info(as_stored
                   ? frames + "; they stay so, as the given intrinsics have it"
                   : frames + "; they are shaded upright with square pixels, " + size_text(size));
}

}  // namespace

ShadeSource open_frames(const fs::path& frames, const fs::path* lens, const RunContext& context) {
  Next stored = stored_frames(frames);
  StoredPicture first;
  if (!stored(first)) throw BadDataError(frames, "holds no frame");
  const Lens found = lens_for(first, frames, lens, context);
  tell(first, found.of_stored_pixels, context);
  Next all = of_one_size(with_first(std::move(first), std::move(stored)));
  if (found.of_stored_pixels) return {std::move(all), found.camera};
  Next upright = [all = std::move(all)](StoredPicture& picture) {
    if (!all(picture)) return false;
    make_upright(picture);
    return true;
  };
  return {std::move(upright), found.camera};
}

void drive_clip(std::size_t in_memory, const std::function<std::shared_ptr<void>()>& take,
                const std::vector<ClipStep>& steps) {
  using Item = std::shared_ptr<void>;
  using tbb::filter_mode;
  tbb::filter<void, Item> chain =
      tbb::make_filter<void, Item>(filter_mode::serial_in_order, [&](tbb::flow_control& flow) {
        Item item = take();
        if (!item) flow.stop();
        return item;
      });
  for (const ClipStep& step : steps)
    chain = chain & tbb::make_filter<Item, Item>(
                        step.in_turn ? filter_mode::serial_in_order : filter_mode::parallel,
                        [&step](Item item) {
                          step.work(item.get());
                          return item;
                        });
  tbb::parallel_pipeline(
      in_memory, chain & tbb::make_filter<Item, void>(filter_mode::parallel, [](const Item&) {}));
}

Mask insets_of(const Next& next, const RunContext& context) {
  constexpr std::size_t kMost = 2000;
  InsetFinder finder;
  try {
    StoredPicture picture;
    for (std::size_t i = 0; i < kMost && next(picture); ++i) {
      context.throw_if_cancelled();
      finder.add(picture.color);
    }
  } catch (const BadDataError&) {
    // It is told when the frames themselves are read.
  }
  return finder.find();
}

Mask insets_of(const fs::path& frames, const fs::path* lens, const RunContext& context) {
  if (!fs::is_directory(frames) && is_frame_name(frames)) return {};
  const RunContext quiet(nullptr, nullptr, nullptr);  // all is said when they are shaded
  return insets_of(open_frames(frames, lens, quiet).next, context);
}

}  // namespace organbake
