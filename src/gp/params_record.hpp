/// \file params_record.hpp
/// Sizes of the record of hyperparameters. New fields are added at the end, before the CRC, and
/// have no effect if all their bytes are 0. So the fields of a record of the version before are the
/// first fields of a record of this version.
#pragma once

#include "gpom/params.h"

namespace gpom
{

constexpr uint32_t kRecordHeadBytes = 4 + 2; ///< Magic and version.
constexpr uint32_t kRecordCrcBytes = 4;
constexpr uint32_t kRecordBytesBefore = 98; ///< Size of a record of the version before.

} // namespace gpom
