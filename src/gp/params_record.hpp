/// \file params_record.hpp
/// Sizes of stored hyperparameters. New fields come at the end, before the CRC, and are neutral if
/// all their bytes are 0: a record of the version before is the beginning of one of this version.
#pragma once

#include "gpom/params.h"

namespace gpom
{

constexpr uint32_t kRecordHeadBytes = 4 + 2; ///< Magic and version.
constexpr uint32_t kRecordCrcBytes = 4;
constexpr uint32_t kRecordBytesBefore = 98; ///< Of the version before.

} // namespace gpom
