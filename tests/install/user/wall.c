#include "wall.h"

gpom_status_t see_wall(gpom_map_t *map)
{
    static const float ranges_m[] = {5.1f, 5.0f, 5.0f, 5.0f, 5.1f};
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    const gpom_pose_t pose = {0.0, 0.0, 0.0, NULL};
    const gpom_scan_t scan = {0, -0.2, 0.1, ranges_m, 5};
    return gpom_scan_insert(map, &scan, &sensor, &pose);
}
