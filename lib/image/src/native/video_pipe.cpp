// SPDX-License-Identifier: Apache-2.0
// A video is written by ffmpeg, which reads pictures from a pipe.
#include "organbake/image/video_pipe.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"

extern char** environ;

namespace organbake {
namespace {

struct Container {
  const char* ending;
  const char* name;  // ffmpeg's; it would go by the ending, which a temporary name lacks
};
constexpr Container kContainers[] = {
    {".mp4", "mp4"}, {".mkv", "matroska"}, {".mov", "mov"}, {".webm", "webm"}, {".avi", "avi"}};

std::string container_of(const std::filesystem::path& file) {
  const std::string ending = lower_ending(file);
  for (const Container& container : kContainers)
    if (ending == container.ending) return container.name;
  throw UsageError(file.string() + ": is no video that can be written");
}

// Even sides are what yuv420p, the one format every viewer plays, can hold. Untagged, its colours
// would be read by one matrix or another, by the picture's size, and in one range or another, by
// ffmpeg's version. x264's bytes depend on the number
// of its threads, so that is fixed.
std::vector<std::string> ffmpeg_arguments(const VideoFormat& format, const std::string& container,
                                          const std::string& target) {
  const std::string size = std::to_string(format.width) + "x" + std::to_string(format.height);
  std::istringstream words(
      "ffmpeg -loglevel error -y -f rawvideo -pix_fmt rgb24 -s " + size + " -r " +
      to_text(format.frames_per_second) +
      " -i - -vf "
      "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:in_range=pc:out_range=tv "
      "-color_range tv -colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1 "
      "-pix_fmt yuv420p -threads 4 -fflags +bitexact -flags:v +bitexact");
  std::vector<std::string> arguments(std::istream_iterator<std::string>(words), {});
  if (format.megabits_per_second > 0)
    arguments.insert(arguments.end(), {"-b:v", to_text(format.megabits_per_second) + "M"});
  arguments.insert(arguments.end(), {"-f", container, target});
  return arguments;
}

}  // namespace

std::vector<std::string> VideoPipe::endings() {
  std::vector<std::string> endings;
  for (const Container& container : kContainers) endings.emplace_back(container.ending);
  return endings;
}

VideoPipe::VideoPipe(const std::filesystem::path& file, const VideoFormat& format)
    : file_(file_to_write(file)), temporary_(temporary_file(file_)) {
  const std::vector<std::string> arguments =
      ffmpeg_arguments(format, container_of(file), temporary_.string());
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  ::signal(SIGPIPE, SIG_IGN);  // a dead ffmpeg is an error of write(), not our end
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw IoError::writing(file_, std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  // In a group of its own, or a terminal's Ctrl-C would end it before we have heard of it.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error =
      ::posix_spawnp(&process_, "ffmpeg", &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  input_ = ends[1];
  if (error != 0) {
    process_ = -1;
    ::close(input_);
    throw IoError::writing(file_, "needs the program ffmpeg (apt-get install ffmpeg): " +
                                      std::string(std::strerror(error)));
  }
}

VideoPipe::~VideoPipe() {
  if (process_ <= 0) return;
  ::kill(process_, SIGTERM);
  wait();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

int VideoPipe::wait() {
  if (input_ >= 0) ::close(input_);
  input_ = -1;
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return status;
}

void VideoPipe::add(const Rgb8Image& frame) {
  for (std::size_t done = 0; done < frame.pixels.size();) {
    const ssize_t written = ::write(input_, frame.pixels.data() + done, frame.pixels.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      throw IoError::writing(file_,
                             "ffmpeg stopped taking frames: " + std::string(std::strerror(errno)));
    done += static_cast<std::size_t>(written);
  }
}

void VideoPipe::finish() {
  const int status = wait();
  std::error_code error;
  if (status == 0) std::filesystem::rename(temporary_, file_, error);
  if (status == 0 && !error) return;
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
  throw IoError::writing(
      file_, status == 0 ? error.message() : "ffmpeg failed; its own words stand above");
}

}  // namespace organbake
