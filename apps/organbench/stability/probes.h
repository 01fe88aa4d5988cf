// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "organbake/core/random.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

using ProbeFolder = std::filesystem::path;

// Throws NotFinite naming `what`.
void expect_finite(double value, const char* what);
void expect_finite(const TriangleMesh& mesh, const char* what);

double probe_isosurface(RandomStream& random, const ProbeFolder&);
double probe_label_surface(RandomStream& random, const ProbeFolder&);
double probe_decimate(RandomStream& random, const ProbeFolder&);
double probe_place(RandomStream& random, const ProbeFolder&);
double probe_capture(RandomStream& random, const ProbeFolder&);
double probe_deform(RandomStream& random, const ProbeFolder&);
double probe_pulls(RandomStream& random, const ProbeFolder&);
double probe_warp(RandomStream& random, const ProbeFolder&);
double probe_shade(RandomStream& random, const ProbeFolder&);
double probe_register(RandomStream& random, const ProbeFolder&);
double probe_volume_files(RandomStream& random, const ProbeFolder& folder);
double probe_mesh_files(RandomStream& random, const ProbeFolder& folder);
double probe_picture_files(RandomStream& random, const ProbeFolder& folder);
double probe_documents(RandomStream& random, const ProbeFolder& folder);

}  // namespace organbake
