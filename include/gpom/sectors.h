/** \file sectors.h
 *  How far all is free about a pose, by sectors: for collision prevention, for vector field
 *  histograms, and for controllers that cannot hold a map.
 *
 *  The answer comes from the coarse layer (lowres.h) as it is now. Only cells of class GPOM_FREE
 *  are free. Everything outside of the raster is unknown. */
#ifndef GPOM_SECTORS_H
#define GPOM_SECTORS_H

#include "gpom/lowres.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most sectors of one call. */
#define GPOM_SECTORS_MAX 3600u

/** A pose that looks about. */
typedef struct {
    double x_m;     /**< Place, map frame [m]. */
    double y_m;     /**< Place, map frame [m]. */
    double yaw_rad; /**< Direction of sector 0, counter-clockwise from the x axis of the map frame;
                         -1e6 .. 1e6 [rad]. */
    float range_m;  /**< Cells farther away are ignored; > 0, at most 2^20 cells [m]. */
    float radius_m; /**< Cells whose centre is within this distance are the robot's own place and
                         are ignored; >= 0 [m]. 0: no cell is. */
} gpom_lookout_t;

/** Flag: the sector ends in unknown cells at the robot's edge, within two cells of radius_m. So
 *  nothing is known of it. */
#define GPOM_SECTOR_UNKNOWN 1u

/** A sector of the plane about a pose. Sector i of n spans 2 pi / n about the bearing 2 pi i / n,
 *  counter-clockwise from forward. Lengths are rounded down by at most 1e-6 of themselves and
 *  1e-6 of the range. 16 bytes. */
typedef struct {
    float free_m;         /**< So far all is free straight along the bearing [m]; range_m: all of
                               it. Never less than distance_m. */
    float distance_m;     /**< Least distance to a cell that is not free and overlaps the sector,
                               even with a corner only: to the nearest point of this cell [m].
                               range_m: there is none. */
    uint16_t probability; /**< Probability of occupancy of that cell [1 / 65535]. If there is none:
                               the greatest probability of the cells whose centre is in the sector
                               and within range. */
    uint8_t variance;     /**< Variance of the same cell, as in gpom_cell_t. */
    uint8_t cls;          /**< gpom_class_t of that cell. GPOM_FREE: no cell ends the sector. */
    uint8_t flags;        /**< 0, or GPOM_SECTOR_UNKNOWN. */
} gpom_sector_t;

/** Look about a pose in the coarse layer. Safe in any thread and in an interrupt, like
 *  gpom_lowres_copy(): cells may come from different moments, but all lie in info->raster and in
 *  the frame of info->frame_epoch.
 *
 *  Of cells at the same distance, the one with the greatest probability ends a sector; an unknown
 *  cell counts as more than 1. A cell that touches the side of a sector within 2e-6 rad may count
 *  in it.
 *
 *  sectors    n_sectors sectors, output.
 *  n_sectors  1 .. GPOM_SECTORS_MAX.
 *  info       output: what the raster covered and how fresh it was. NULL is allowed.
 *  Errors     GPOM_ERR_ARG (null, no coarse layer, a number not finite or out of range):
 *             `sectors` is untouched. GPOM_ERR_REACH (the place is outside of the raster): all
 *             sectors are unknown, with lengths 0. GPOM_ERR_BUSY as for gpom_lowres_copy():
 *             `sectors` is unspecified.
 *  Cost: for each try at most one arctangent for each free cell within range, and five for each
 *  other cell. Cells behind the ends of all sectors are not looked at. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_sectors(const gpom_map_t *map,
                                                   const gpom_lookout_t *lookout,
                                                   gpom_sector_t *sectors, size_t n_sectors,
                                                   gpom_lowres_info_t *info);

#ifdef __cplusplus
}
#endif
#endif
