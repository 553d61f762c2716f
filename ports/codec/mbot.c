#include "ports/codec/mbot.h"

#include "ports/codec/cursor.h"

static void lidar_fields(gpom_cursor_t *c, gpom_wire_lidar_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_count(c, &m->ranges_m.n);
    const uint32_t n = m->ranges_m.n;
    gpom_cursor_same_count(c, &m->bearings_rad.n, n);
    gpom_cursor_same_count(c, &m->stamps_us.n, n);
    gpom_cursor_same_count(c, &m->intensities.n, n);
    gpom_cursor_floats(c, &m->ranges_m);
    gpom_cursor_floats(c, &m->bearings_rad);
    gpom_cursor_times(c, &m->stamps_us);
    gpom_cursor_floats(c, &m->intensities);
}

static void pose2d_fields(gpom_cursor_t *c, gpom_wire_pose2d_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_f32(c, &m->x_m);
    gpom_cursor_f32(c, &m->y_m);
    gpom_cursor_f32(c, &m->yaw_rad);
}

static void occupancy_grid_fields(gpom_cursor_t *c, gpom_wire_occupancy_grid_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_f32(c, &m->corner_x_m);
    gpom_cursor_f32(c, &m->corner_y_m);
    gpom_cursor_f32(c, &m->cell_m);
    gpom_cursor_count(c, &m->nx);
    gpom_cursor_count(c, &m->ny);
    uint32_t n_cells = (uint32_t)((uint64_t)m->nx * m->ny);
    gpom_cursor_count(c, &n_cells);
    gpom_cursor_require(c, (uint64_t)m->nx * m->ny == n_cells, GPOM_WIRE_COUNT);
    gpom_cursor_bytes_view(c, &m->cells, n_cells);
}

GPOM_WIRE_DEFINE_DECODE(gpom_wire_lidar_decode, gpom_wire_lidar_t, lidar_fields,
                        GPOM_WIRE_LIDAR_FINGERPRINT, false)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_lidar_encode, gpom_wire_lidar_t, lidar_fields,
                        GPOM_WIRE_LIDAR_FINGERPRINT, false)
GPOM_WIRE_DEFINE_DECODE(gpom_wire_pose2d_decode, gpom_wire_pose2d_t, pose2d_fields,
                        GPOM_WIRE_POSE2D_FINGERPRINT, false)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_pose2d_encode, gpom_wire_pose2d_t, pose2d_fields,
                        GPOM_WIRE_POSE2D_FINGERPRINT, false)
GPOM_WIRE_DEFINE_DECODE(gpom_wire_occupancy_grid_decode, gpom_wire_occupancy_grid_t,
                        occupancy_grid_fields, GPOM_WIRE_OCCUPANCY_GRID_FINGERPRINT, false)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_occupancy_grid_encode, gpom_wire_occupancy_grid_t,
                        occupancy_grid_fields, GPOM_WIRE_OCCUPANCY_GRID_FINGERPRINT, false)
