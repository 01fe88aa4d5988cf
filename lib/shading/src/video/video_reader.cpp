// SPDX-License-Identifier: GPL-3.0-or-later
// Videos are decoded in a module of their own (lib/shading/video), loaded with the first of them.
#include "organbake/shading/video_reader.h"

#include <dlfcn.h>

#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "video_module.h"

namespace organbake {
namespace {

// Never closed: what libav registers is not made to be unloaded.
decltype(&organbake_open_video) module_door() {
  const std::filesystem::path file =
      (program_folder() / ".." / "lib" / "organbake" / "organbake_video.so").lexically_normal();
  void* module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* door = module ? ::dlsym(module, "organbake_open_video") : nullptr;
  if (!door)
    throw Error(ExitCode::internal, file.string() + ": cannot be loaded: " + ::dlerror() +
                                        "; without it no video can be read: the installation is "
                                        "incomplete");
  return reinterpret_cast<decltype(&organbake_open_video)>(door);
}

}  // namespace

struct VideoReader::Impl {
  std::unique_ptr<VideoDecoder> decoder;
};

VideoReader::VideoReader(const std::filesystem::path& path) : impl_(new Impl) {
  static const auto open = module_door();
  impl_->decoder.reset(open(path));
}
VideoReader::~VideoReader() = default;
VideoReader::VideoReader(VideoReader&&) noexcept = default;

bool VideoReader::next(StoredPicture& frame) { return impl_->decoder->next(frame); }
std::size_t VideoReader::frames_read() const { return impl_->decoder->frames_read(); }

}  // namespace organbake
