/** \file gpom_map.h
 *  gpom.map_t: a tile of the low-resolution map in one UDP datagram. */
#ifndef GPOM_CODEC_GPOM_MAP_H
#define GPOM_CODEC_GPOM_MAP_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_MAP_FINGERPRINT UINT64_C(0x428375daa5a20b5c)

/** Bytes of an encoded tile. */
#define GPOM_WIRE_MAP_BYTES(n_cells) ((size_t)97 + (size_t)2 * (size_t)(n_cells))

/** Most cells of a tile: 651. Such a tile fits a datagram with the longest channel name. */
#define GPOM_WIRE_MAP_CELLS_MAX                                                                    \
    ((GPOM_WIRE_DATAGRAM_BYTES - 8u - GPOM_WIRE_CHANNEL_MAX - 1u - 97u) / 2u)

/** Class of a cell. The first three values are those of gpom_class_t. */
enum {
    GPOM_WIRE_FREE = 0,
    GPOM_WIRE_UNSURE = 1,
    GPOM_WIRE_OCCUPIED = 2,
    GPOM_WIRE_UNKNOWN = 3 /**< No beam says anything about the cell. */
};

/** Code of the probability of a cell whose class is unknown. */
#define GPOM_WIRE_PROBABILITY_UNKNOWN 255u

/** lcmtypes/gpom_map_t.lcm. */
typedef struct {
    int64_t stamp_us;
    uint32_t map_sequence;
    uint16_t i_tile;
    uint16_t n_tiles;
    uint8_t keyframe;
    int32_t frame_epoch;
    double pose[3];     /**< x [m], y [m], yaw [rad], map frame. */
    double corner_m[2]; /**< Lower left corner of cell 0, map frame. */
    float cell_m;
    float prior_variance;
    uint16_t map_nx;
    uint16_t map_ny;
    uint16_t ix0;
    uint16_t iy0;
    uint16_t nx;
    uint16_t ny;
    const uint8_t *probability;    /**< nx * ny codes. After decoding, a view into the message. */
    const uint8_t *variance_class; /**< nx * ny codes. After decoding, a view into the message. */
} gpom_wire_map_t;

/** Read a message. Views are valid as long as `bytes` is. Geometry and every code are checked:
 *  the faults GPOM_WIRE_COUNT and GPOM_WIRE_VALUE are errors of the sender. After a fault nothing
 *  in `message` is valid. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_map_decode(gpom_wire_map_t *message,
                                                      const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written: at most
 *  GPOM_WIRE_MAP_BYTES(GPOM_WIRE_MAP_CELLS_MAX). 0 if they do not fit, a pointer is missing, or
 *  gpom_wire_map_decode() would refuse a field. */
GPOM_NODISCARD size_t gpom_wire_map_encode(const gpom_wire_map_t *message, uint8_t *bytes,
                                           size_t n_bytes);

/** Code of a probability p given in 65535ths: ceil(254 p). It is monotone and never stands for a
 *  lower probability than p. */
uint8_t gpom_wire_probability_code(uint16_t probability_65535ths, uint8_t cls);

/** Code of a class and of a variance v given in 255ths of the prior variance: ceil(63 v). */
uint8_t gpom_wire_variance_class_code(uint8_t variance_255ths, uint8_t cls);

/** Probability of a code, which must not be GPOM_WIRE_PROBABILITY_UNKNOWN. */
float gpom_wire_probability(uint8_t probability_code);

/** Variance of a code, as a fraction of the prior variance. */
float gpom_wire_variance_fraction(uint8_t variance_class_code);

/** Class of a code: GPOM_WIRE_FREE and so on. */
uint8_t gpom_wire_class(uint8_t variance_class_code);

#ifdef __cplusplus
}
#endif
#endif
