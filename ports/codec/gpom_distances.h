/** \file gpom_distances.h
 *  gpom.distances_t: distances of a tile of the low-resolution map in one UDP datagram. */
#ifndef GPOM_CODEC_GPOM_DISTANCES_H
#define GPOM_CODEC_GPOM_DISTANCES_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_DISTANCES_FINGERPRINT UINT64_C(0x1ea00e74ace59f1c)

/** Bytes of an encoded tile. */
#define GPOM_WIRE_DISTANCES_BYTES(n_cells) ((size_t)69 + (size_t)8 * (size_t)(n_cells))

/** Most cells of a tile: 166. Such a tile fits a datagram with the longest channel name. */
#define GPOM_WIRE_DISTANCES_CELLS_MAX                                                              \
    ((GPOM_WIRE_DATAGRAM_BYTES - 8u - GPOM_WIRE_CHANNEL_MAX - 1u - 69u) / 8u)

/** In place of an offset: there is no such cell. */
#define GPOM_WIRE_OFFSET_NONE (-32768)

/** lcmtypes/gpom_distances_t.lcm. An offset takes two bytes, as gpom_wire_offset_put() writes it.
 */
typedef struct {
    int64_t stamp_us;
    uint32_t sequence;
    uint16_t i_tile;
    uint16_t n_tiles;
    uint8_t keyframe;
    int32_t frame_epoch;
    double corner_m[2]; /**< Lower left corner of cell 0, map frame. */
    float cell_m;
    uint16_t map_nx;
    uint16_t map_ny;
    uint16_t ix0;
    uint16_t iy0;
    uint16_t nx;
    uint16_t ny;
    const uint8_t *occupied_dx; /**< nx * ny offsets. After decoding, a view into the message. */
    const uint8_t *occupied_dy; /**< As occupied_dx. */
    const uint8_t *not_free_dx; /**< As occupied_dx. */
    const uint8_t *not_free_dy; /**< As occupied_dx. */
} gpom_wire_distances_t;

/** Read a message. Views are valid as long as `bytes` is. Geometry and every offset are checked: an
 *  offset that leaves the map, or that is none in one direction alone, is GPOM_WIRE_VALUE. After a
 *  fault nothing in `message` is valid. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_distances_decode(gpom_wire_distances_t *message,
                                                            const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written: at most
 *  GPOM_WIRE_DISTANCES_BYTES(GPOM_WIRE_DISTANCES_CELLS_MAX). 0 if they do not fit, a pointer is
 *  missing, or gpom_wire_distances_decode() would refuse a field. */
GPOM_NODISCARD size_t gpom_wire_distances_encode(const gpom_wire_distances_t *message,
                                                 uint8_t *bytes, size_t n_bytes);

/** Write offset i of an array of offsets. */
void gpom_wire_offset_put(uint8_t *offsets, uint32_t i, int16_t offset);

/** Offset i of an array of offsets. */
int16_t gpom_wire_offset(const uint8_t *offsets, uint32_t i);

#ifdef __cplusplus
}
#endif
#endif
