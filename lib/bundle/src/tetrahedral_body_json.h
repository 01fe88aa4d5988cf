// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/json_fields.h"
#include "organbake/bundle/tetrahedral_body.h"

namespace organbake {

Json tetrahedral_body_to_json(const TetrahedralBody& body);
// Throws BadDataError naming the key; vertex_count is the proxy's.
TetrahedralBody tetrahedral_body_from_json(const JsonField& field, std::size_t vertex_count);

}  // namespace organbake
