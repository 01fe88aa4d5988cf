// SPDX-License-Identifier: Apache-2.0
// The folders that a viewer offers to open, with a mark on those that are bundles.
#include "organbake/player/bundle_list.h"

#include <algorithm>
#include <system_error>
#include <tuple>

namespace organbake {
namespace fs = std::filesystem;

std::vector<ListedFolder> list_folders(const fs::path& folder) {
  std::vector<ListedFolder> listed;
  std::error_code problem;
  for (fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, problem),
       end;
       !problem && at != end; at.increment(problem)) {
    std::error_code unreadable;
    const std::string name = at->path().filename().string();
    if (name.starts_with('.') || !at->is_directory(unreadable)) continue;
    listed.push_back({name, fs::exists(at->path() / "manifest.json", unreadable)});
  }
  std::sort(listed.begin(), listed.end(), [](const ListedFolder& a, const ListedFolder& b) {
    return std::tie(b.is_bundle, a.name) < std::tie(a.is_bundle, b.name);
  });
  return listed;
}

}  // namespace organbake
