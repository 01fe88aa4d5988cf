// SPDX-License-Identifier: Apache-2.0
// Files and folders on POSIX systems. Results are written under a hidden temporary name that
// carries the process id, and renamed when they are whole; what killed processes left is recognised
// by that id and removed. Files of strangers are opened folder by folder, so that no link leads
// out.
#include "organbake/core/files.h"

#include <fcntl.h>
#include <linux/fs.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

std::optional<pid_t> owner(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix)) return std::nullopt;
  const std::size_t mark = name.rfind(kTemporaryMark);
  if (mark == std::string::npos) return std::nullopt;
  const std::size_t number = mark + kTemporaryMark.size();
  if (!prefix.empty() && number != prefix.size()) return std::nullopt;
  pid_t pid = 0;
  const char* begin = name.data() + number;
  const auto result = std::from_chars(begin, name.data() + name.size(), pid);
  if (result.ec != std::errc() || pid <= 0) return std::nullopt;
  return pid;
}

// A process that nobody has waited for yet (a zombie) keeps its id, but will write no more. Its
// state stands behind its name, which is in parentheses and may hold some itself.
bool is_zombie(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');
  return name_end != std::string::npos && name_end + 2 < line.size() && line[name_end + 2] == 'Z';
}

bool alive(pid_t pid) { return (::kill(pid, 0) == 0 || errno == EPERM) && !is_zombie(pid); }

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }
  // Some file systems report a full disk only here.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

std::string reason() { return std::strerror(errno); }

// Opening a pipe or a device for reading may wait for ever, or do something.
constexpr int kToRead = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;

std::size_t openable_size(const fs::path& path, int fd) {
  if (fd < 0) throw NoInputError(path, "cannot be opened: " + reason());
  struct stat status {};
  if (::fstat(fd, &status) != 0) throw IoError::reading(path, reason());
  if (S_ISDIR(status.st_mode)) throw NoInputError(path, "is a folder, a file is needed");
  if (!S_ISREG(status.st_mode))
    throw NoInputError(path, "is a pipe or a device, a file is needed; write it to one first");
  return static_cast<std::size_t>(status.st_size);
}

// Reads as many bytes as there are, up to the span's size; returns how many.
std::size_t read_some(int fd, std::span<std::byte> bytes, const fs::path& path) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(fd, bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw IoError::reading(path, reason());
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

void write_all(int fd, std::span<const std::byte> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw IoError::writing(path, "cannot be written: " + reason());
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

// Hidden, next to the target (rename needs one file system), named after the process that owns it.
std::string temporary_prefix(const fs::path& target) {
  return "." + target.filename().string() + std::string(kTemporaryMark);
}

// renameat2, or its nearest likeness on file systems that know no flags (NFS): then a moment exists
// in which the old folder is gone and the new one not yet there, never a half-written one.
bool rename_folder(const fs::path& from, const fs::path& to, unsigned flags) {
  if (::syscall(SYS_renameat2, AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0)
    return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  std::error_code ignored;
  if (flags == RENAME_NOREPLACE && fs::exists(to, ignored)) {
    errno = EEXIST;
    return false;
  }
  if (flags == RENAME_EXCHANGE) remove_all_of(to);
  return ::rename(from.c_str(), to.c_str()) == 0;
}

IoError cannot_rename(const fs::path& target) {
  return IoError::writing(target, "cannot be renamed into place: " + reason());
}

fs::path without_slash(const fs::path& folder) {  // "out/" names the folder "out"
  return folder.has_filename() ? folder : folder.parent_path();
}

fs::path parent_of(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

std::vector<std::byte> read_all_of(const Descriptor& file, const fs::path& path,
                                   std::uint64_t max_bytes) {
  const std::size_t size = openable_size(path, file.get());
  if (size > max_bytes)
    throw BadDataError(path, "is " + std::to_string(size) + " bytes; at most " +
                                 std::to_string(max_bytes) + " are accepted here");
  std::vector<std::byte> bytes(size);
  if (read_some(file.get(), bytes, path) < size)
    throw IoError::reading(path, "became shorter while it was read");
  return bytes;
}

[[noreturn]] void refuse_inside(const fs::path& path, int error) {
  constexpr int kNotThere[] = {0, ENOENT, ELOOP, ENOTDIR, ENXIO, ENAMETOOLONG};
  if (std::find(std::begin(kNotThere), std::end(kNotThere), error) != std::end(kNotThere))
    throw BadDataError(path, "is missing or not a regular file (links are not followed)");
  if (error == EIO) throw IoError::reading(path, std::strerror(error));
  throw NoInputError(path, std::string("cannot be opened: ") + std::strerror(error));
}

// Opened folder by folder, so that nothing can turn into a link between a look and its use.
Descriptor open_inside(const fs::path& folder, const fs::path& file) {
  const fs::path full = folder / file;
  const auto opened = [&](int fd) {
    if (fd < 0) refuse_inside(full, errno);
    return Descriptor(fd);
  };
  constexpr int kFolder = O_PATH | O_DIRECTORY | O_CLOEXEC;
  Descriptor at = opened(::open(folder.c_str(), kFolder));
  for (const fs::path& name : file.parent_path()) {
    if (name == ".." || name.is_absolute()) refuse_inside(full, 0);
    at = opened(::openat(at.get(), name.c_str(), kFolder | O_NOFOLLOW));
  }
  Descriptor descriptor = opened(::openat(at.get(), file.filename().c_str(), kToRead | O_NOFOLLOW));
  struct stat status {};
  if (::fstat(descriptor.get(), &status) != 0) refuse_inside(full, errno);
  if (!S_ISREG(status.st_mode)) refuse_inside(full, 0);
  return descriptor;
}

template <class Iterator, class Take>
std::vector<fs::path> entries_of(const fs::path& folder, const Take& take) {
  std::vector<fs::path> files;
  std::error_code error;
  for (Iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (take(*it)) files.push_back(it->path().lexically_relative(folder));
  if (error) throw NoInputError(folder, "cannot be listed: " + error.message());
  return files;
}

bool is_regular(const fs::directory_entry& entry) { return entry.is_regular_file(); }

template <class Take>
std::vector<fs::path> sorted_below(const fs::path& folder, const Take& take) {
  std::vector<fs::path> files = entries_of<fs::recursive_directory_iterator>(folder, take);
  std::ranges::sort(files, {}, [](const fs::path& path) { return path.generic_string(); });
  return files;
}

}  // namespace

fs::path temporary_file(const fs::path& file) {
  const std::string prefix = file.filename().string() + std::string(kTemporaryMark);
  const fs::path folder = parent_of(file);
  remove_stale_temporaries(folder, prefix);
  return folder / (prefix + std::to_string(::getpid()));
}

void remove_all_of(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error) fs::remove_all(path, error);
}

void remove_stale_temporaries(const fs::path& folder, const std::string& prefix) {
  // A folder under a temporary name is new, and its writer's alone. It may get thousands of frames,
  // and looking through it for each would take longer than writing them.
  if (folder.native().find(kTemporaryMark) != std::string::npos) return;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const auto pid = owner(entry.path().filename().string(), prefix);
    if (pid && !alive(*pid)) remove_all_of(entry.path());
  }
}

std::vector<std::byte> read_file(const fs::path& path, std::uint64_t max_bytes) {
  return read_all_of(Descriptor(::open(path.c_str(), kToRead)), path, max_bytes);
}

std::vector<std::byte> read_file_inside(const fs::path& folder, const fs::path& file,
                                        std::uint64_t max_bytes) {
  return read_all_of(open_inside(folder, file), folder / file, max_bytes);
}

std::string read_beginning(const fs::path& path, std::size_t bytes) {
  const Descriptor file(::open(path.c_str(), kToRead));
  openable_size(path, file.get());
  std::string first(bytes, '\0');
  first.resize(read_some(file.get(), std::as_writable_bytes(std::span(first)), path));
  return first;
}

std::string read_text_file(const fs::path& path, std::size_t max_bytes) {
  const std::vector<std::byte> bytes = read_file(path, max_bytes);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

fs::path file_to_write(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) throw IoError::writing(path, "is a folder; name a file");
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw IoError::writing(path, "is a device or a pipe; name a file");
  if (!fs::is_symlink(fs::symlink_status(path, ignored))) return path;
  if (fs::exists(status)) return fs::canonical(path);
  return path.parent_path() / fs::read_symlink(path);  // of a file that is still to come
}

void write_file_atomically(const fs::path& named, std::span<const std::byte> bytes) {
  const fs::path path = file_to_write(named);
  const fs::path temporary = temporary_file(path);
  try {
    Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    if (file.get() < 0) throw IoError::writing(path, "cannot be created: " + reason());
    write_all(file.get(), bytes, path);
    if (!file.close()) throw IoError::writing(path, "cannot be written: " + reason());
    if (::rename(temporary.c_str(), path.c_str()) != 0)
      throw IoError::writing(path, "cannot be replaced: " + reason());
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text.data(), text.size())));
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError::writing(folder, "cannot be made: " + error.message());
}

std::vector<fs::path> list_files(const fs::path& folder) {
  return sorted_below(folder, is_regular);
}

std::vector<fs::path> list_all_but_folders(const fs::path& folder) {
  return sorted_below(folder, [](const fs::directory_entry& entry) {
    return entry.is_symlink() || !entry.is_directory();
  });
}

std::vector<fs::path> list_numbered_files(const fs::path& folder) {
  std::vector<fs::path> files = entries_of<fs::directory_iterator>(folder, is_regular);
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return ::strverscmp(a.c_str(), b.c_str()) < 0;
  });
  return files;
}

std::optional<double> number_behind(const std::string& word, const std::filesystem::path& file) {
  std::ifstream text(file);
  std::string read;
  double number = 0;
  while (text >> read)
    if (read == word && text >> number) return number;
  return std::nullopt;
}

void write_to_stdout(std::string_view text) {
  const bool taken = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!taken || std::fflush(stdout) != 0)
    throw IoError::writing("stdout", "cannot be written: " + std::string(std::strerror(errno)));
}

std::string lower_ending(const std::filesystem::path& file) {
  return lower_case(file.extension().string());
}

bool is_picture_name(const std::filesystem::path& file) {
  const std::string ending = lower_ending(file);
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

bool is_frame_name(const std::filesystem::path& file) {
  return is_picture_name(file) || lower_ending(file) == ".exr";
}

bool is_mesh_name(const std::filesystem::path& file) {
  constexpr std::string_view kEndings[] = {".ply", ".obj", ".stl", ".off", ".vtk",
                                           ".vtp", ".vtu", ".glb", ".gltf"};
  return std::find(std::begin(kEndings), std::end(kEndings), lower_ending(file)) !=
         std::end(kEndings);
}

void AtomicFolder::sweep(const fs::path& target) {
  const fs::path folder = without_slash(target);
  const fs::path parent = parent_of(folder);
  remove_stale_temporaries(parent, temporary_prefix(folder));
  remove_stale_temporaries(parent,
                           folder.filename().string() + std::string(kTemporaryMark));  // of a file
}

void AtomicFolder::sweep_inside(const fs::path& folder) { remove_stale_temporaries(folder, {}); }

AtomicFolder::AtomicFolder(fs::path target) : target_(without_slash(target)) {
  const fs::path parent = parent_of(target_);
  std::error_code error;
  fs::create_directories(parent, error);
  const std::string prefix = temporary_prefix(target_);
  if (!error) remove_stale_temporaries(parent, prefix);
  static std::atomic<unsigned> counter{0};
  temporary_ = parent / (prefix + std::to_string(::getpid()) + "-" + std::to_string(counter++));
  if (!error) fs::create_directory(temporary_, error);
  if (error) throw IoError::writing(target_, "cannot be created: " + error.message());
}

AtomicFolder::~AtomicFolder() {
  if (committed_) return;
  remove_all_of(temporary_);
}

bool AtomicFolder::commit(IfExists if_exists) {
  if (rename_folder(temporary_, target_, RENAME_NOREPLACE)) return committed_ = true;
  if (errno != EEXIST) throw cannot_rename(target_);
  if (if_exists == IfExists::keep_existing) return false;
  // Swapping the two leaves no moment without a whole folder under the target's name.
  if (!rename_folder(temporary_, target_, RENAME_EXCHANGE)) throw cannot_rename(target_);
  committed_ = true;
  remove_all_of(temporary_);
  return true;
}

}  // namespace organbake
