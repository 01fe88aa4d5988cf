// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/pipelines/export_options.h"
#include "session.h"

namespace organbake {

// Writes what a bundle is exported to: a folder, or of the format `web` the page itself. The
// formats' libraries are heavy, so a module does it. Throws NoInputError for no bundle, UsageError
// where the output cannot be, and what the export throws.
void write_export(const std::filesystem::path& bundle, const ExportOptions& options,
                  const std::filesystem::path& output, Session& session);
// The page that holds the bundle and its player.
void write_player_page(const std::filesystem::path& bundle, const std::filesystem::path& page,
                       Session& session);

}  // namespace organbake
