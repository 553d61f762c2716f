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

/** Most cells of a tile, so that it fits a datagram with the longest channel name: 651. */
#define GPOM_WIRE_MAP_CELLS_MAX                                                                    \
    ((GPOM_WIRE_DATAGRAM_BYTES - 8u - GPOM_WIRE_CHANNEL_MAX - 1u - 97u) / 2u)

/** Class of a cell; the first three are gpom_class_t. */
enum {
    GPOM_WIRE_FREE = 0,
    GPOM_WIRE_UNSURE = 1,
    GPOM_WIRE_OCCUPIED = 2,
    GPOM_WIRE_UNKNOWN = 3 /**< No beam says anything about the cell. */
};

/** Code of a cell's probability where its class is unknown. */
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
    const uint8_t *probability;    /**< nx * ny codes; decoded: a view into the message. */
    const uint8_t *variance_class; /**< nx * ny codes; likewise. */
} gpom_wire_map_t;

/** Read a message. Views are valid as long as `bytes` is. Geometry and every code are checked:
 *  faults GPOM_WIRE_COUNT and GPOM_WIRE_VALUE are a sender's error. After a fault nothing in
 *  `message` may be relied on. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_map_decode(gpom_wire_map_t *message,
                                                      const uint8_t *bytes, size_t n_bytes);

/** Bytes written, at most GPOM_WIRE_MAP_BYTES(GPOM_WIRE_MAP_CELLS_MAX); 0 if they do not fit, a
 *  pointer is missing, or a field breaks what gpom_wire_map_decode() checks. */
GPOM_NODISCARD size_t gpom_wire_map_encode(const gpom_wire_map_t *message, uint8_t *bytes,
                                           size_t n_bytes);

/** Code of a probability given in 65535ths: ceil(254 p), never below it; monotone. */
uint8_t gpom_wire_probability_code(uint16_t probability_65535ths, uint8_t cls);

/** Code of a variance given in 255ths of the prior variance, and the class: ceil(63 v). */
uint8_t gpom_wire_variance_class_code(uint8_t variance_255ths, uint8_t cls);

/** Probability of a code other than GPOM_WIRE_PROBABILITY_UNKNOWN. */
float gpom_wire_probability(uint8_t probability_code);

/** Variance as a fraction of the prior variance. */
float gpom_wire_variance_fraction(uint8_t variance_class_code);

/** Class: GPOM_WIRE_FREE and so on. */
uint8_t gpom_wire_class(uint8_t variance_class_code);

#ifdef __cplusplus
}
#endif
#endif
