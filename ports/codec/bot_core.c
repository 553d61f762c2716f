#include "ports/codec/bot_core.h"

#include "ports/codec/cursor.h"

static void planar_lidar_fields(gpom_cursor_t *c, gpom_wire_planar_lidar_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_count(c, &m->ranges_m.n);
    gpom_cursor_floats(c, &m->ranges_m);
    gpom_cursor_count(c, &m->intensities.n);
    gpom_cursor_floats(c, &m->intensities);
    gpom_cursor_f32(c, &m->angle_min_rad);
    gpom_cursor_f32(c, &m->angle_step_rad);
}

static void bot_pose_fields(gpom_cursor_t *c, gpom_wire_bot_pose_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_f64s(c, m->position_m, 3);
    gpom_cursor_f64s(c, m->velocity_mps, 3);
    gpom_cursor_f64s(c, m->orientation, 4);
    gpom_cursor_f64s(c, m->rotation_rate_rps, 3);
    gpom_cursor_f64s(c, m->acceleration_mps2, 3);
}

GPOM_WIRE_DEFINE_DECODE(gpom_wire_planar_lidar_decode, gpom_wire_planar_lidar_t,
                        planar_lidar_fields, GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT, false)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_planar_lidar_encode, gpom_wire_planar_lidar_t,
                        planar_lidar_fields, GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT, false)
GPOM_WIRE_DEFINE_DECODE(gpom_wire_bot_pose_decode, gpom_wire_bot_pose_t, bot_pose_fields,
                        GPOM_WIRE_BOT_POSE_FINGERPRINT, false)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_bot_pose_encode, gpom_wire_bot_pose_t, bot_pose_fields,
                        GPOM_WIRE_BOT_POSE_FINGERPRINT, false)
