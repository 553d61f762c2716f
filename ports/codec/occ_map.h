/** \file occ_map.h
 *  The type of libbot's occ-map: occ_map.pixel_map_t. */
#ifndef GPOM_CODEC_OCC_MAP_H
#define GPOM_CODEC_OCC_MAP_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_PIXEL_MAP_FINGERPRINT UINT64_C(0xe4b099a4cce13107)

typedef enum {
    GPOM_WIRE_PIXEL_FLOAT = 1,
    GPOM_WIRE_PIXEL_DOUBLE = 2,
    GPOM_WIRE_PIXEL_INT32 = 3,
    GPOM_WIRE_PIXEL_UINT32 = 4,
    GPOM_WIRE_PIXEL_INT16 = 5,
    GPOM_WIRE_PIXEL_UINT16 = 6,
    GPOM_WIRE_PIXEL_INT8 = 7,
    GPOM_WIRE_PIXEL_UINT8 = 8
} gpom_wire_pixel_t;

/** lcmtypes/occ_map_pixel_map_t.lcm. */
typedef struct {
    int64_t stamp_us;
    uint32_t nx;
    uint32_t ny;
    double centre0_m[2]; /**< Centre of cell 0. */
    double end_m[2];
    double cell_m;
    uint8_t is_compressed; /**< 1: pixels are a zlib stream, which the codec does not unpack. */
    uint8_t pixel;         /**< gpom_wire_pixel_t. */
    const uint8_t *pixels; /**< n_bytes bytes. A view after decoding. */
    uint32_t n_bytes;
} gpom_wire_pixel_map_t;

/** Read a message. After a fault nothing in `message` is valid. If the pixels are not compressed
 *  and n_bytes is not the size of nx * ny pixels, the fault is GPOM_WIRE_COUNT. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_pixel_map_decode(gpom_wire_pixel_map_t *message,
                                                            const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written. 0 if they do not fit, a pointer is missing, or the
 *  decoder would refuse a field. */
GPOM_NODISCARD size_t gpom_wire_pixel_map_encode(const gpom_wire_pixel_map_t *message,
                                                 uint8_t *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
