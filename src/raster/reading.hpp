/// \file reading.hpp
/// Reading the low-resolution map, in the thread that changes it or in another thread: between
/// begin_read() and end_read(), at most GPOM_LOWRES_TRIES times.
#pragma once

#include "src/raster/lowres.hpp"

#include <string.h>

namespace gpom
{

/// False if a window is changing now.
inline bool begin_read(const Lowres &lowres, uint32_t &counter)
{
    counter = load(lowres.counter);
    return counter % 2 == 0;
}

/// True if no window changed since begin_read().
inline bool end_read(const Lowres &lowres, uint32_t counter)
{
    return load(lowres.counter) == counter;
}

/// The result is valid only if end_read() then returns true.
inline gpom_lowres_info_t read_info(const Lowres &lowres, const Layer &layer, Window &window)
{
    uint32_t words[kPublishedWords];
    for (size_t i = 0; i < kPublishedWords; ++i) {
        words[i] = load(layer.published[i]);
    }
    Published published;
    memcpy(&published, words, sizeof published);
    window = published.window;
    gpom_lowres_info_t info = {};
    info.raster = {window.x0_m + window.ix0 * window.cell_m,
                   window.y0_m + window.iy0 * window.cell_m, window.cell_m, window.nx, window.ny};
    info.stamp0_us = published.stamp0_us;
    info.frame_epoch = published.frame_epoch;
    info.newest_ms = load(lowres.newest_ms);
    info.map_sequence = load(lowres.map_sequence);
    info.n_dirty = load(layer.n_dirty);
    return info;
}

/// Reads the stamp before the value. The writer stores the value before the stamp. So the stamp is
/// never newer than the value.
inline gpom_cell_t read_cell(const Cell &cell)
{
    const uint32_t stamp_ms = load(cell.stamp_ms);
    const uint32_t value = load(cell.value);
    return {static_cast<uint16_t>(value & 0xffff), static_cast<uint8_t>(value >> 16 & 0xff),
            static_cast<uint8_t>(class_of_value(value)), stamp_ms};
}

} // namespace gpom
